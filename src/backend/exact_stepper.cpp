#include "backend/exact_stepper.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace pf {
namespace {

// Lists shorter than this are worked through by the calling thread: waking the others costs more.
constexpr std::size_t kAlone = 256;

// Lowers value to `to`; whether it was higher.
bool lower(std::uint32_t& value, std::uint32_t to) {
  std::atomic_ref<std::uint32_t> shared(value);
  std::uint32_t seen = shared.load(std::memory_order_relaxed);
  while (to < seen) {
    if (shared.compare_exchange_weak(seen, to, std::memory_order_relaxed)) return true;
  }
  return false;
}

std::uint32_t read(std::uint32_t& value) {
  return std::atomic_ref<std::uint32_t>(value).load(std::memory_order_relaxed);
}

// Whether this call is the first to set the mark.
bool mark_first(std::uint8_t& mark, std::uint8_t to) {
  std::uint8_t expected = 0;
  return std::atomic_ref<std::uint8_t>(mark).compare_exchange_strong(expected, to, std::memory_order_relaxed);
}

std::int32_t saturated(double units) { return static_cast<std::int32_t>(std::min(units, 1.0e9)); }

}  // namespace

// One step. All of a phase's items can be worked on at once: each writes only its own parcel's entries,
// bounds are lowered atomically, and lines change in resolve() alone, two disjoint parcels an event.
template <Boundary kBoundary>
struct ExactStepper::Rounds {
  ExactStepper& self;
  const Problem& problem;
  const ExactConstants& c;
  ParcelArrays& lines;
  ExactBall& ball;
  Vec2i* at_end;
  bool recording;
  Search search = choose_search(kBoundary);
  Vec2i ball_centre;            // at the begin, position units
  std::int32_t ball_reach = 0;  // half side of the box around it that holds all parcels that may meet it
  float units_in_step = 0.0F;   // position units that a speed of 1 m/s covers in the step
  bool round_hit_ball = false;
  double ball_fastest_mps = 0.0;
  double fastest_now = 0.0;  // bound on the speed of every line so far
  Event ball_event;
  std::uint32_t ball_bound = kNoTick;
  std::vector<std::uint32_t>& near_ball = self.lists_[0];
  std::vector<std::uint32_t>& active = self.lists_[1];   // parcels with an event before the end
  std::vector<std::uint32_t>& lowered = self.lists_[2];  // parcels whose bound is below their event
  std::vector<std::uint32_t>& work = self.lists_[3];     // those whose bound is still to be passed on
  std::vector<std::uint32_t>& changed = self.lists_[4];  // in this round
  std::vector<std::uint32_t>& flagged = self.lists_[5];

  Rounds(ExactStepper& stepper, const Problem& p, ParcelArrays& parcels, ExactBall& the_ball, Vec2i* end,
         bool record)
      : self(stepper),
        problem(p),
        c(p.constants),
        lines(parcels),
        ball(the_ball),
        at_end(end),
        recording(record) {
    units_in_step = static_cast<float>(c.units_per_tick * c.length);
    fastest_now = problem.fastest_mps;
    if (c.ball == BallRole::absent) return;
    const double moved = c.max_speed_mps * c.units_per_tick * c.length;
    const Vec2d centre = ball.line.anchor_units + travelled(c, ball.line.velocity_mps, -ball.line.tick);
    ball_centre = {saturated_units(centre.x), saturated_units(centre.y)};
    ball_reach = saturated(c.ball_contact + 2.0 * moved + kRoundingMargin);
  }

  std::size_t size() const { return lines.id.size(); }
  Line line(std::uint32_t i) const { return {lines.position[i], lines.velocity[i], lines.tick[i]}; }
  Event event(std::uint32_t i) const {
    const std::uint32_t partner = self.event_partner_[i];
    return {self.event_tick_[i], partner, is_parcel(partner) ? lines.id[partner] : partner};
  }
  bool has_event(std::uint32_t i) const { return self.event_tick_[i] != kNoTick; }
  bool is_near_ball(std::uint32_t i) const {
    const Vec2i from = separation<kBoundary>(c.step.physics.world, ball_centre, problem.space.position[i]);
    return std::abs(static_cast<std::int64_t>(from.x)) <= ball_reach &&
           std::abs(static_cast<std::int64_t>(from.y)) <= ball_reach;
  }

  // visit(worker, item) for the items 0 .. count - 1, shared among the threads if there are many.
  template <class Visit>
  void each(std::size_t count, Visit visit) {
    if (count < kAlone) {
      for (std::size_t k = 0; k < count; ++k) visit(self.workers_[0], k);
      return;
    }
    self.team_.run([&](unsigned thread) {
      const auto [begin, end] = self.team_.share(thread, count);
      for (std::size_t k = begin; k < end; ++k) visit(self.workers_[thread], k);
    });
  }
  template <class Visit>
  void each_of(const std::vector<std::uint32_t>& list, Visit visit) {
    each(list.size(), [&](Worker& worker, std::size_t k) { visit(worker, list[k]); });
  }

  // Fills worker.scratch.finds with the parcels that i may touch within the step if it moves no further than
  // moved_units from where it was at the begin, and they keep to their present lines.
  void search_near(Worker& worker, std::uint32_t i, double moved_units) {
    worker.scratch.finds.clear();
    if (!c.step.physics.parcels.contacts) return;
    const double others = fastest_now * c.units_per_tick * c.length;
    const double distance = c.step.contact_distance + moved_units + others + kRoundingMargin;
    worker.space.reach = saturated(distance + static_cast<double>(problem.travel));
    worker.space.filter_distance2 = static_cast<float>(distance * distance * (1.0 + 1e-5));
    search(worker.space, i, worker.scratch);
  }

  // The same for a parcel that keeps to the line that it has.
  void search_along_line(Worker& worker, std::uint32_t i) {
    search_near(worker, i, static_cast<double>(self.step_speed_[i]) * c.units_per_tick * c.length);
  }

  Event earliest(const Line& line_i, const std::vector<std::uint32_t>& candidates, std::uint32_t i) const {
    Event best;
    for (const std::uint32_t j : candidates) {
      if (is_retired(lines.position[j])) continue;
      keep_earlier(best, {meeting<kBoundary>(c, line_i, line(j)), j, lines.id[j]});
    }
    keep_edge_event<kBoundary>(c, line_i, best);
    if (c.ball != BallRole::absent && is_near_ball(i))
      keep_earlier(best, {meeting_ball<kBoundary>(c, ball.line, line_i), kBallPartner, kBallPartner});
    return best;
  }

  void set_event(std::uint32_t i, const Event& event) {
    self.event_tick_[i] = event.tick;
    self.event_partner_[i] = event.partner;
    self.bound_[i] = event.tick;
  }

  // Of those found, only the ones that the cheap test cannot rule out. Lines must be those of the begin.
  void keep_if_meeting(std::uint32_t i, Vec2f velocity, std::vector<std::uint32_t>& found) const {
    const Vec2i* present = problem.space.position;
    const auto contact = static_cast<float>(c.step.contact_distance);
    std::size_t num = 0;
    for (const std::uint32_t j : found) {
      const Vec2i offset = separation<kBoundary>(c.step.physics.world, present[i], present[j]);
      found[num] = j;
      num += may_meet(offset, lines.velocity[j] - velocity, contact, units_in_step) ? 1U : 0U;
    }
    found.resize(num);
  }

  // First prediction, of a parcel on the line that it has at the begin.
  void predict_first(Worker& worker, std::uint32_t i) {
    const Line here = line(i);
    at_end[i] = position_at<kBoundary>(c, here, static_cast<std::int32_t>(c.length));
    self.event_tick_[i] = self.bound_[i] = kNoTick;
    self.event_partner_[i] = kNoPartner;
    if (is_retired(here.anchor)) return;
    const float speed2 = dot(here.velocity, here.velocity);
    if (!(speed2 < 1e30F)) {
      worker.tally.invalid(lines.id[i]);
      at_end[i] = here.anchor;
      return;
    }
    worker.tally.moved(0, speed2);
    self.step_speed_[i] = std::sqrt(speed2) * (1.0F + 1e-6F);
    search_along_line(worker, i);
    keep_if_meeting(i, here.velocity, worker.scratch.finds);
    set_event(i, earliest(here, worker.scratch.finds, i));
    if (has_event(i)) worker.found.push_back(i);
  }

  void predict_all() {
    each(size(),
         [&](Worker& worker, std::size_t i) { predict_first(worker, static_cast<std::uint32_t>(i)); });
    self.collect_found(active);
    if (c.ball == BallRole::absent) return;
    each(size(), [&](Worker& worker, std::size_t k) {
      const auto i = static_cast<std::uint32_t>(k);
      if (!is_retired(problem.space.position[i]) && is_near_ball(i)) worker.found.push_back(i);
    });
    self.collect_found(near_ball);
  }

  // The ball's earliest event, among the parcels whose own earliest it is and the walls.
  void predict_ball() {
    ball_event = {};
    if (c.ball != BallRole::participant) return;
    for (const std::uint32_t i : near_ball) {
      if (self.event_partner_[i] == kBallPartner)
        keep_earlier(ball_event, {self.event_tick_[i], i, lines.id[i]});
    }
    keep_ball_edge_event<kBoundary>(c, ball.line, ball_event);
    ball_bound = ball_event.tick;
  }

  void lower_bound(Worker& worker, std::uint32_t k, std::uint32_t to) {
    if (to != kNoTick && lower(self.bound_[k], to)) worker.found.push_back(k);
  }

  // Passes on to the neighbours of i how early i, after whatever happens to it first, can touch them.
  void spread(Worker& worker, std::uint32_t i) {
    const std::uint32_t at = read(self.bound_[i]);
    const Line here = line(i);
    if (is_retired(here.anchor)) return;
    const double by_then = static_cast<double>(self.step_speed_[i]) * at;
    const double after = c.max_speed_mps * (c.length - at);
    search_near(worker, i, (by_then + after) * c.units_per_tick);
    for (const std::uint32_t k : worker.scratch.finds) {
      if (!is_retired(lines.position[k]))
        lower_bound(worker, k, earliest_touch<kBoundary>(c, here, at, line(k)));
    }
    if (c.ball != BallRole::participant || !is_near_ball(i)) return;
    const double ball_mps = speed_of(ball.line.velocity_mps);
    lower(ball_bound, earliest_touch_ball<kBoundary>(c, ball.line, here, at, ball_mps));
  }

  void spread_ball() {
    const std::uint32_t at = ball_bound;
    each_of(near_ball, [&](Worker& worker, std::uint32_t k) {
      if (is_retired(lines.position[k])) return;
      const double mps = speed_of(to_double(lines.velocity[k]));
      lower_bound(worker, k, earliest_touch_ball<kBoundary>(c, ball.line, line(k), at, mps));
    });
  }

  // Lowers the bounds until nothing changes: then no true event of a parcel precedes its bound.
  void spread_bounds() {
    lowered.clear();
    work = active;
    std::uint32_t ball_spread_from = kNoTick;
    while (!work.empty() || ball_bound < ball_spread_from) {
      each_of(work, [&](Worker& worker, std::uint32_t i) { spread(worker, i); });
      if (ball_bound < ball_spread_from) {
        ball_spread_from = ball_bound;
        spread_ball();
      }
      self.collect_found(work);
      lowered.insert(lowered.end(), work.begin(), work.end());
    }
  }

  bool is_safe(std::uint32_t i) const {
    const std::uint32_t tick = self.event_tick_[i];
    if (tick == kNoTick || self.bound_[i] != tick) return false;
    const std::uint32_t partner = self.event_partner_[i];
    if (!is_parcel(partner)) return true;
    return self.event_partner_[partner] == i && self.event_tick_[partner] == tick &&
           self.bound_[partner] == tick;
  }

  void save(Worker& worker, std::uint32_t i) {
    if (self.saved_mark_[i] != 0) return;
    self.saved_mark_[i] = 1;
    worker.saved.push_back({i, line(i), lines.clock.empty() ? 0U : lines.clock[i]});
  }

  void record(Worker& worker, std::uint32_t tick, std::uint32_t first, std::uint32_t second) {
    const std::uint64_t at = problem.begin_tick + tick;
    worker.event_hash += event_hash(at, std::min(first, second), std::max(first, second));
    if (recording) worker.events.push_back({at, std::min(first, second), std::max(first, second)});
  }

  void store(Worker& worker, std::uint32_t i, const Line& now) {
    const float speed2 = dot(now.velocity, now.velocity);
    self.step_speed_[i] = std::max(self.step_speed_[i], std::sqrt(speed2) * (1.0F + 1e-6F));
    lines.position[i] = now.anchor;
    lines.velocity[i] = now.velocity;
    lines.tick[i] = now.tick;
    at_end[i] = position_at<kBoundary>(c, now, static_cast<std::int32_t>(c.length));
    worker.fastest2 = std::max(worker.fastest2, static_cast<double>(speed2));
    self.mark_[i] = kChanged;
    worker.found.push_back(i);
  }

  // Whether the event of i at `tick` comes so soon after i's last one that it loses nothing (the TC model).
  bool in_contact_time(std::uint32_t i, std::uint32_t tick) const {
    return c.clock_ticks != 0 && c.begin + tick - lines.clock[i] <= c.clock_ticks;
  }
  void set_clock(std::uint32_t i, std::uint32_t tick) {
    if (!lines.clock.empty()) lines.clock[i] = c.begin + tick;
  }

  void resolve_pair(Worker& worker, std::uint32_t i, std::uint32_t j, std::uint32_t tick) {
    const bool in_order = lines.id[i] < lines.id[j];
    const std::uint32_t a = in_order ? i : j, b = in_order ? j : i;
    save(worker, a);
    save(worker, b);
    Line first = line(a), second = line(b);
    anchor_at<kBoundary>(c, first, tick);
    anchor_at<kBoundary>(c, second, tick);
    const bool elastic = in_contact_time(a, tick) || in_contact_time(b, tick);
    collide<kBoundary>(c, first, second, elastic, worker.tally);
    store(worker, a, first);
    store(worker, b, second);
    set_clock(a, tick);
    set_clock(b, tick);
    record(worker, tick, lines.id[a], lines.id[b]);
  }

  void resolve_edge(Worker& worker, std::uint32_t i, std::uint32_t tick) {
    const std::uint32_t partner = self.event_partner_[i];
    save(worker, i);
    Line now = line(i);
    anchor_at<kBoundary>(c, now, tick);
    meet_edge(c, partner, now);
    if (partner == kExit) worker.tally.retired();
    store(worker, i, now);
    set_clock(i, tick);
    record(worker, tick, lines.id[i], partner);
  }

  BallKick resolve_ball_hit(Worker& worker, std::uint32_t i, std::uint32_t tick) {
    save(worker, i);
    Line now = line(i);
    anchor_at<kBoundary>(c, now, tick);
    const BallKick kick = collide_with_ball<kBoundary>(c, ball.line, tick, now, worker.tally);
    store(worker, i, now);
    record(worker, tick, lines.id[i], kBallPartner);
    return kick;
  }

  void resolve(Worker& worker, std::uint32_t i) {
    if (!is_safe(i)) return;
    const std::uint32_t partner = self.event_partner_[i];
    const std::uint32_t tick = self.event_tick_[i];
    if (is_parcel(partner)) {
      if (i < partner) resolve_pair(worker, i, partner, tick);
    } else if (partner != kBallPartner) {
      resolve_edge(worker, i, tick);
    } else if (c.ball == BallRole::frozen) {
      resolve_ball_hit(worker, i, tick);
    }
  }

  // The ball's own event of the round, if it is safe.
  void resolve_ball() {
    round_hit_ball = false;
    if (ball_event.tick == kNoTick || ball_bound != ball_event.tick) return;
    const std::uint32_t tick = ball_event.tick;
    const bool hit = is_parcel(ball_event.partner);
    if (hit && !is_safe(ball_event.partner)) return;
    Worker& worker = self.workers_[0];
    BallKick kick{};
    if (hit)
      kick = resolve_ball_hit(worker, ball_event.partner, tick);
    else
      record(worker, tick, ball_event.partner, kBallPartner);
    change_ball(c, tick, ball_event.partner, kick, ball);
    ball_fastest_mps = std::max(ball_fastest_mps, surface_speed_mps(c.step.physics, ball.line));
    round_hit_ball = true;
  }

  // Flags k, unless its line has changed anyway, to predict again.
  void flag(Worker& worker, std::uint32_t k) {
    if (mark_first(self.mark_[k], kFlagged)) worker.found.push_back(k);
  }

  // Flags those neighbours of a changed parcel that meet it first now, or were to meet it before.
  void flag_neighbours(Worker& worker, std::uint32_t i, const std::vector<std::uint32_t>& near) {
    const Line here = line(i);
    for (const std::uint32_t k : near) {
      const bool has_changed =
          std::atomic_ref<std::uint8_t>(self.mark_[k]).load(std::memory_order_relaxed) == kChanged;
      if (has_changed || is_retired(lines.position[k])) continue;
      if (self.event_partner_[k] == i) {
        flag(worker, k);
      } else if (!is_retired(here.anchor)) {
        const Event now{meeting<kBoundary>(c, line(k), here), i, lines.id[i]};
        if (now.tick != kNoTick && comes_before(now, event(k))) flag(worker, k);
      }
    }
  }

  void flag_near_ball(Worker& worker, std::uint32_t k) {
    if (self.mark_[k] == kChanged || is_retired(lines.position[k])) return;
    const Event now{meeting_ball<kBoundary>(c, ball.line, line(k)), kBallPartner, kBallPartner};
    if (self.event_partner_[k] == kBallPartner || (now.tick != kNoTick && comes_before(now, event(k))))
      flag(worker, k);
  }

  void predict_changed(Worker& worker, std::uint32_t i) {
    search_along_line(worker, i);
    flag_neighbours(worker, i, worker.scratch.finds);
    const Line here = line(i);
    set_event(i, is_retired(here.anchor) ? Event{} : earliest(here, worker.scratch.finds, i));
  }

  void predict_flagged(Worker& worker, std::uint32_t i) {
    search_along_line(worker, i);
    set_event(i, earliest(line(i), worker.scratch.finds, i));
  }

  // After a round: new predictions of the parcels that changed and of those that must heed them.
  void predict_again() {
    self.collect_found(changed);
    each_of(changed, [&](Worker& worker, std::uint32_t i) { predict_changed(worker, i); });
    if (round_hit_ball)
      each_of(near_ball, [&](Worker& worker, std::uint32_t k) { flag_near_ball(worker, k); });
    self.collect_found(flagged);
    each_of(flagged, [&](Worker& worker, std::uint32_t i) { predict_flagged(worker, i); });
    for (const std::uint32_t i : lowered) self.bound_[i] = self.event_tick_[i];
    std::erase_if(active, [&](std::uint32_t i) { return self.mark_[i] != kUntouched; });
    for (const auto* list : {&changed, &flagged}) {
      for (const std::uint32_t i : *list) {
        self.mark_[i] = kUntouched;
        if (has_event(i)) active.push_back(i);
      }
    }
  }

  double fastest_mps() const {
    double fastest2 = 0.0;
    for (const Worker& worker : self.workers_) fastest2 = std::max(fastest2, worker.fastest2);
    return std::sqrt(fastest2);
  }

  // Rounds until no event is left; whether they came to their end within the bounds.
  bool run(std::uint32_t& num_rounds) {
    predict_all();
    while (true) {
      predict_ball();
      if (active.empty() && ball_event.tick == kNoTick) return true;
      if (num_rounds == problem.most_rounds) return false;
      ++num_rounds;
      spread_bounds();
      each_of(active, [&](Worker& worker, std::uint32_t i) { resolve(worker, i); });
      resolve_ball();
      if (std::max(fastest_mps(), ball_fastest_mps) > c.max_speed_mps) return false;
      fastest_now = std::max(fastest_now, fastest_mps());
      predict_again();
    }
  }
};

void ExactStepper::prepare(const Problem& problem, std::size_t num_parcels) {
  workers_.resize(team_.size());
  for (Worker& worker : workers_) {
    worker.space = problem.space;
    worker.tally = {};
    worker.found.clear();
    worker.saved.clear();
    worker.events.clear();
    worker.event_hash = 0;
    worker.fastest2 = 0.0;
  }
  event_tick_.resize(num_parcels);
  event_partner_.resize(num_parcels);
  bound_.resize(num_parcels);
  mark_.resize(num_parcels);
  saved_mark_.resize(num_parcels);
  step_speed_.resize(num_parcels);
}

void ExactStepper::collect_found(std::vector<std::uint32_t>& all) {
  all.clear();
  for (Worker& worker : workers_) {
    all.insert(all.end(), worker.found.begin(), worker.found.end());
    worker.found.clear();
  }
}

void ExactStepper::forget_saved(bool put_back, ParcelArrays& lines) {
  for (const Worker& worker : workers_) {
    for (const Saved& saved : worker.saved) {
      saved_mark_[saved.index] = 0;
      if (!put_back) continue;
      lines.position[saved.index] = saved.line.anchor;
      lines.velocity[saved.index] = saved.line.velocity;
      lines.tick[saved.index] = saved.line.tick;
      if (!lines.clock.empty()) lines.clock[saved.index] = saved.clock;
    }
  }
}

template <Boundary kBoundary>
ExactOutcome ExactStepper::run(const Problem& problem, ParcelArrays& lines, ExactBall& ball, Vec2i* at_end,
                               std::vector<EventRecord>* events) {
  const ExactBall ball_before = ball;
  ExactOutcome outcome;
  Rounds<kBoundary> rounds(*this, problem, lines, ball, at_end, events != nullptr);
  outcome.finished = rounds.run(outcome.num_rounds);
  if (!outcome.finished) ball = ball_before;
  forget_saved(!outcome.finished, lines);
  outcome.fastest_mps = rounds.fastest_mps();
  outcome.needed_bound_mps = std::max(outcome.fastest_mps, rounds.ball_fastest_mps);
  for (const Worker& worker : workers_) {
    if (!outcome.finished) break;
    outcome.tally.add(worker.tally);
    outcome.event_hash += worker.event_hash;
    if (events) events->insert(events->end(), worker.events.begin(), worker.events.end());
  }
  if (outcome.finished)
    outcome.fastest_at_begin_mps = std::sqrt(static_cast<double>(outcome.tally.max_speed2));
  return outcome;
}

ExactOutcome ExactStepper::step(const Problem& problem, ParcelArrays& lines, ExactBall& ball, Vec2i* at_end,
                                std::vector<EventRecord>* events) {
  prepare(problem, lines.id.size());
  switch (problem.constants.step.physics.world.boundary) {
    case Boundary::walls:
      return run<Boundary::walls>(problem, lines, ball, at_end, events);
    case Boundary::periodic:
      return run<Boundary::periodic>(problem, lines, ball, at_end, events);
    default:
      return run<Boundary::open>(problem, lines, ball, at_end, events);
  }
}

std::uint64_t ExactStepper::memory_bytes() const {
  return 4 * (step_speed_.capacity() + event_tick_.capacity() + event_partner_.capacity() +
              bound_.capacity()) +
         mark_.capacity() + saved_mark_.capacity();
}

}  // namespace pf
