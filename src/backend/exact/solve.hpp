// Method `exact` on the CPU: one cluster's events through a step, in the order of time, as if the other
// parcels kept to the lines that they have at its begin. Where one of them turns out to be another cluster's,
// it stops.
#pragma once

#include <algorithm>

#include "backend/exact/step_state.hpp"

namespace pf {

template <Boundary kBoundary>
class ClusterSolver {
 public:
  ClusterSolver(ExactStep<kBoundary>& step, ExactWorker& worker, std::uint32_t thread, std::uint32_t index,
                Cluster& cluster)
      : step_(step), c_(step.c), worker_(worker), index_(index), cluster_(cluster) {
    cluster_.thread = thread;
    cluster_.first_member = static_cast<std::uint32_t>(worker_.members.size());
    cluster_.first_event = static_cast<std::uint32_t>(worker_.events.size());
    cluster_.num_members = cluster_.num_events = 0;
    cluster_.is_solved = false;
    cluster_.fastest2 = 0.0;
    cluster_.event_hash = 0;
    cluster_.tally = {};
  }

  // cluster.is_solved, or worker.conflicts has the other cluster.
  void solve() {
    first_border_ = worker_.border.size();
    worker_.queue.clear();
    for (std::uint32_t k = 0; k < cluster_.num_seeds; ++k) {
      const std::uint32_t i = step_.seeds[cluster_.first_seed + k];
      push(add(i));
    }
    if (cluster_.has_ball) begin_ball();
    cluster_.is_solved = go_through_events();
    cluster_.num_members = static_cast<std::uint32_t>(worker_.members.size()) - cluster_.first_member;
    if (!cluster_.is_solved) worker_.border.resize(first_border_);
  }

 private:
  static constexpr std::uint32_t kBallMember = 0xFFFFFFFEU;

  Member& member(std::uint32_t m) { return worker_.members[m]; }
  std::uint32_t id(std::uint32_t parcel) const { return step_.lines.id[parcel]; }
  BallMember& ball() { return step_.ball_member; }

  std::uint32_t add(std::uint32_t i) {
    const auto m = static_cast<std::uint32_t>(worker_.members.size());
    Member now;
    now.index = i;
    now.line = step_.line(i);
    const std::uint32_t partner = step_.event_partner[i];
    const std::uint64_t key = step_.event_key[i];
    if (key != kNoEvent)
      now.event = {static_cast<std::uint32_t>(key >> 32U), partner, static_cast<std::uint32_t>(key)};
    now.clock = step_.lines.clock.empty() ? 0U : step_.lines.clock[i];
    worker_.members.push_back(now);
    step_.place[i] = m;
    return m;
  }

  // The parcel's place among the members, which it joins if it is nobody's; kNone if it is another cluster's.
  std::uint32_t join(std::uint32_t i) {
    if (step_.owner_of(i) == index_) return step_.place[i];
    const std::uint32_t owner = step_.take(step_.owner[i], index_);
    if (owner == index_) return add(i);
    worker_.conflicts.push_back({index_, owner});
    return kNone;
  }

  // ---- the queue

  static bool is_later(const ExactWorker::Entry& a, const ExactWorker::Entry& b) {
    if (a.tick != b.tick) return a.tick > b.tick;
    if (a.low != b.low) return a.low > b.low;
    return a.high > b.high;
  }
  void push(std::uint32_t m, std::uint32_t own_id, const Event& event, std::uint32_t version) {
    if (event.tick == kNoTick) return;
    worker_.queue.push_back(
        {event.tick, std::min(own_id, event.partner_id), std::max(own_id, event.partner_id), m, version});
    std::push_heap(worker_.queue.begin(), worker_.queue.end(), is_later);
  }
  void push(std::uint32_t m) { push(m, id(member(m).index), member(m).event, member(m).version); }

  void set_event(std::uint32_t m, const Event& event) {
    ++member(m).version;
    member(m).event = event;
    push(m);
  }
  void set_ball_event(const Event& event) {
    ++ball().version;
    ball().event = event;
    push(kBallMember, kBallPartner, event, ball().version);
  }

  bool go_through_events() {
    while (!worker_.queue.empty()) {
      const ExactWorker::Entry next = worker_.queue.front();
      std::pop_heap(worker_.queue.begin(), worker_.queue.end(), is_later);
      worker_.queue.pop_back();
      const bool is_ball = next.member == kBallMember;
      if (next.version != (is_ball ? ball().version : member(next.member).version)) continue;
      if (cluster_.num_events == step_.problem.most_events) return true;  // too many: the step is given up
      if (!(is_ball ? resolve_ball_event() : resolve(next.member))) return false;
    }
    return true;
  }

  // ---- events

  void record(std::uint32_t tick, std::uint32_t first, std::uint32_t second) {
    const std::uint64_t at =
        step_.problem.begin_tick + (static_cast<std::uint64_t>(tick) << step_.problem.coarse);
    const std::uint32_t low = std::min(first, second), high = std::max(first, second);
    cluster_.event_hash += event_hash(at, low, high);
    ++cluster_.num_events;
    if (step_.recording) worker_.events.push_back({at, low, high});
  }

  // Whether an event of m at `tick` comes so soon after its last one that it loses nothing (the TC model).
  bool in_contact_time(std::uint32_t m, std::uint32_t tick) {
    return c_.clock_ticks != 0 && c_.begin + tick - member(m).clock <= c_.clock_ticks;
  }

  void store(std::uint32_t m, const Line& now, std::uint32_t tick) {
    Member& it = member(m);
    if (it.has_changed) {
      worker_.segments.push_back({it.line, tick, it.segments});
      it.segments = static_cast<std::uint32_t>(worker_.segments.size()) - 1;
    }
    const float speed2 = dot(now.velocity, now.velocity);
    it.line = now;
    it.has_changed = true;
    cluster_.fastest2 = std::max(cluster_.fastest2, static_cast<double>(speed2));
  }

  bool resolve(std::uint32_t m) {
    const Event event = member(m).event;
    if (is_parcel(event.partner)) {
      const std::uint32_t other = join(event.partner);
      if (other == kNone) return false;
      if (is_out_of_date(m, other))
        predict_anew(m);
      else
        resolve_pair(m, other, event.tick);
      return true;
    }
    if (event.partner != kBallPartner) {
      resolve_edge(m, event);
    } else if (step_.has_participant()) {
      worker_.conflicts.push_back({index_, step_.ball_owner});
      return false;
    } else {
      hit_ball(m, event.tick, step_.ball.line);
      predict_changed(m);
    }
    return true;
  }

  // Whether the partner of m's event has left the line that the event was predicted on; nobody told m. Its
  // true next event is not earlier: that would have taken the other's place.
  bool is_out_of_date(std::uint32_t m, std::uint32_t partner) {
    const Member& other = member(partner);
    if (!other.has_changed) return false;
    return is_retired(other.line.anchor) ||
           meeting<kBoundary>(c_, member(m).line, other.line) != member(m).event.tick;
  }

  void resolve_pair(std::uint32_t one, std::uint32_t other, std::uint32_t tick) {
    const bool in_order = id(member(one).index) < id(member(other).index);
    const std::uint32_t a = in_order ? one : other, b = in_order ? other : one;
    Line first = member(a).line, second = member(b).line;
    anchor_at<kBoundary>(c_, first, tick);
    anchor_at<kBoundary>(c_, second, tick);
    const bool elastic = in_contact_time(a, tick) || in_contact_time(b, tick);
    collide<kBoundary>(c_, first, second, elastic, cluster_.tally);
    store(a, first, tick);
    store(b, second, tick);
    member(a).clock = member(b).clock = c_.begin + tick;
    record(tick, id(member(a).index), id(member(b).index));
    const auto mover = [&](std::uint32_t m) {
      return Mover{member(m).index, step_.disc_of(member(m).index, member(m).line)};
    };
    step_.search({mover(a), mover(b)}, worker_.reached);
    predict_changed(a, b, worker_.reached[0]);
    predict_changed(b, a, worker_.reached[1]);
  }

  void resolve_edge(std::uint32_t m, const Event& event) {
    Line now = member(m).line;
    anchor_at<kBoundary>(c_, now, event.tick);
    meet_edge(c_, event.partner, now);
    if (event.partner == kExit) cluster_.tally.retired();
    store(m, now, event.tick);
    member(m).clock = c_.begin + event.tick;
    record(event.tick, id(member(m).index), event.partner);
    predict_changed(m);
  }

  BallKick hit_ball(std::uint32_t m, std::uint32_t tick, const BallLine& line) {
    Line now = member(m).line;
    anchor_at<kBoundary>(c_, now, tick);
    const BallKick kick = collide_with_ball<kBoundary>(c_, line, tick, now, cluster_.tally);
    store(m, now, tick);
    record(tick, id(member(m).index), kBallPartner);
    return kick;
  }

  bool resolve_ball_event() {
    const Event event = ball().event;
    BallKick kick{};
    std::uint32_t m = kNone;
    if (is_parcel(event.partner)) {
      m = join(event.partner);
      if (m == kNone) return false;
      kick = hit_ball(m, event.tick, ball().now.line);
    } else {
      record(event.tick, event.partner, kBallPartner);
    }
    if (ball().has_changed) ball().segments.push_back({ball().now.line, event.tick});
    change_ball(c_, event.tick, event.partner, kick, ball().now);
    ball().has_changed = true;
    ball().fastest_mps = std::max(ball().fastest_mps, surface_speed_mps(c_.step.physics, ball().now.line));
    ball().event = {};
    if (m != kNone) predict_changed(m);
    predict_ball();
    return true;
  }

  // ---- the ball as a member

  void begin_ball() {
    ball().now = step_.ball;
    ball().has_changed = false;
    ball().fastest_mps = 0.0;
    ball().segments.clear();
    ball().version = 0;
    predict_ball();
  }

  Line line_now(std::uint32_t k) {
    return step_.owner_of(k) == index_ ? member(step_.place[k]).line : step_.line(k);
  }

  void predict_ball() {
    Event best;
    const BallLine& line = ball().now.line;
    for (const std::uint32_t k : step_.near_ball) {
      const Line there = line_now(k);
      if (is_retired(there.anchor)) continue;
      keep_earlier(best, {meeting_ball<kBoundary>(c_, line, there), k, id(k)});
    }
    keep_ball_edge_event<kBoundary>(c_, line, best);
    set_ball_event(best);
  }

  // The ball's event after member m, on a new line, may have come between.
  void heed_ball(const Member& changed) {
    if (ball().event.partner == changed.index) return predict_ball();
    if (is_retired(changed.line.anchor) || !step_.is_near_ball(changed.index)) return;
    const Event now{meeting_ball<kBoundary>(c_, ball().now.line, changed.line), changed.index,
                    id(changed.index)};
    if (now.tick != kNoTick && comes_before(now, ball().event)) set_ball_event(now);
  }

  // ---- predictions

  void keep_edge_and_ball(const Member& it, Event& best) const {
    if (may_reach_edge<kBoundary>(c_, step_.problem.present[it.index]))
      keep_edge_event<kBoundary>(c_, it.line, best);
    if (c_.ball == BallRole::absent || cluster_.has_ball || !step_.is_near_ball(it.index)) return;
    keep_earlier(best, {meeting_ball<kBoundary>(c_, step_.ball.line, it.line), kBallPartner, kBallPartner});
  }

  void predict_changed(std::uint32_t m) {
    if (is_retired(member(m).line.anchor)) {
      set_event(m, {});
      if (cluster_.has_ball) heed_ball(member(m));
      return;
    }
    step_.search(member(m).index, member(m).line, worker_.reached[0]);
    predict_changed(m, kNone, worker_.reached[0]);
  }

  // Of a member on a new line: its next event, and that of members that it meets before theirs. `partner`
  // changed as well and has its own turn. Those whose event was with the member's old line find out when it
  // is due.
  void predict_changed(std::uint32_t m, std::uint32_t partner, const Reached& reached) {
    const Member it = member(m);
    Event best;
    for (const std::uint32_t j : reached.overlapping) {
      const std::uint32_t owner = step_.owner_of(j);
      if (owner == index_) {
        predict_between(it, j, partner, best);
        continue;
      }
      if (owner != kNone) worker_.border.push_back({it.index, j});
      keep_earlier(best, {meeting<kBoundary>(c_, it.line, step_.line(j)), j, id(j)});
    }
    for (const std::uint32_t j : reached.owned) {
      if (step_.owner_of(j) == index_)
        predict_between(it, j, partner, best);
      else
        worker_.border.push_back({it.index, j});
    }
    keep_edge_and_ball(it, best);
    set_event(m, best);
    if (cluster_.has_ball) heed_ball(it);
  }

  // Its event with member j, for both.
  void predict_between(const Member& it, std::uint32_t j, std::uint32_t partner, Event& best) {
    const std::uint32_t n = step_.place[j];
    const Member& other = member(n);
    if (is_retired(other.line.anchor)) return;
    const std::uint32_t tick = meeting<kBoundary>(c_, it.line, other.line);
    keep_earlier(best, {tick, j, id(j)});
    const Event now{tick, it.index, id(it.index)};
    if (n != partner && tick != kNoTick && comes_before(now, other.event)) set_event(n, now);
  }

  // Of a member on the line that it was on.
  void predict_anew(std::uint32_t m) {
    const Member it = member(m);
    Reached& reached = worker_.reached[0];
    step_.search(it.index, it.line, reached);
    Event best;
    const auto consider = [&](std::uint32_t j, const Line& there) {
      if (!is_retired(there.anchor)) keep_earlier(best, {meeting<kBoundary>(c_, it.line, there), j, id(j)});
    };
    for (const std::uint32_t j : reached.overlapping) consider(j, line_now(j));
    for (const std::uint32_t j : reached.owned) {
      if (step_.owner_of(j) == index_) consider(j, member(step_.place[j]).line);
    }
    keep_edge_and_ball(it, best);
    set_event(m, best);
  }

  ExactStep<kBoundary>& step_;
  const ExactConstants& c_;
  ExactWorker& worker_;
  std::uint32_t index_;
  Cluster& cluster_;
  std::size_t first_border_ = 0;
};

}  // namespace pf
