#include "exact/event_match.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "lab/theory.hpp"
#include "model/exact/step_plan.hpp"
#include "model/kinetic_theory.hpp"

namespace pf::test {
namespace {

// Differences up to this, in parcel diameters, can come from positions rounded to units of 1e-7 diameters and
// a few collisions after that.
constexpr double kTolerance = 1e-5;

struct PartnerEvent {
  double time_s;
  std::uint32_t partner;  // parcel id or one of the partner codes of model/exact/events.hpp
};
using PartnerLists = std::vector<std::vector<PartnerEvent>>;  // one for each parcel, then the ball's

PartnerLists lists_of(std::vector<EventRecord> events, std::uint32_t num, double tick_s) {
  std::stable_sort(events.begin(), events.end(),
                   [](const EventRecord& a, const EventRecord& b) { return a.tick < b.tick; });
  PartnerLists lists(num + 1);
  for (const EventRecord& event : events) {
    const double time_s = static_cast<double>(event.tick) * tick_s;
    if (event.first < num) lists[event.first].push_back({time_s, event.second});
    if (event.second < num) lists[event.second].push_back({time_s, event.first});
    if (event.second == kBallPartner) lists[num].push_back({time_s, event.first});
  }
  return lists;
}

PartnerLists lists_of(const std::vector<ReferenceEvent>& events, std::uint32_t num, double start_s) {
  PartnerLists lists(num + 1);
  for (const ReferenceEvent& event : events) {
    using Kind = ReferenceEvent::Kind;
    const double time_s = start_s + event.time_s;
    const std::uint32_t partner = event.kind == Kind::pair     ? event.b
                                  : event.kind == Kind::ball   ? kBallPartner
                                  : event.kind == Kind::wall_x ? kWallX
                                  : event.kind == Kind::wall_y ? kWallY
                                                               : kExit;
    lists[event.a].push_back({time_s, partner});
    if (event.kind == Kind::pair) lists[event.b].push_back({time_s, event.a});
    if (event.kind == Kind::ball) lists[num].push_back({time_s, event.a});
  }
  return lists;
}

// State at a window's start; the reference can run from it up to any time, more than once.
struct Window {
  const SceneRun& run;
  Physics physics;  // the reference's
  std::vector<ReferenceParcel> parcels;
  BallState ball;
  double start_s = 0.0, end_s = 0.0;

  Reference reference() const {
    ReferenceOptions options;
    options.contact_clock_s = contact_clock_s(run.settings, run.physics);
    options.ball_frozen =
        physics.ball.exists && ball_role(run.physics, ball, end_s - start_s) == BallRole::frozen;
    return {physics, parcels, ball, options};
  }

  // Returns whether the closest approach of the two equals the contact distance within the tolerance. time_s:
  // of the run.
  bool grazes(std::uint32_t i, std::uint32_t partner, double time_s) const {
    const auto num = static_cast<std::uint32_t>(parcels.size());
    const bool with_ball = i == num || partner == kBallPartner;
    const std::uint32_t parcel = i == num ? partner : i;
    if (parcel >= num || (!with_ball && partner >= num)) return false;
    const double diameter = 2.0 * physics.parcels.radius_m;
    Reference before = reference();
    before.run_until(std::max(0.0, time_s - start_s - 1e-3 * diameter / physics.reference_speed_mps));
    const std::vector<ReferenceParcel> at = before.parcels();
    const Vec2d other_at = with_ball ? before.ball().position_m : at[partner].position_m;
    const Vec2d other_v = with_ball ? before.ball().velocity_mps : at[partner].velocity_mps;
    Vec2d e = other_at - at[parcel].position_m;
    if (physics.world.boundary == Boundary::periodic) {
      const Vec2d half = to_metres(physics.world, physics.world.half);
      e = {std::remainder(e.x, 2.0 * half.x), std::remainder(e.y, 2.0 * half.y)};
    }
    const Vec2d v = other_v - at[parcel].velocity_mps;
    const double contact_m = with_ball ? physics.ball.radius_m + physics.parcels.radius_m : diameter;
    const double miss_m = std::fabs(cross(e, v)) / length(v);
    return std::fabs(miss_m - contact_m) < kTolerance * contact_m;
  }
};

struct Difference {
  std::uint32_t body;
  double time_s;
  const PartnerEvent* exact;  // null: no more events
  const PartnerEvent* reference;
};

class Comparison {
 public:
  Comparison(const Window& window, const PartnerLists& exact, const PartnerLists& reference,
             MatchResult& result)
      : window_(window), result_(result), tainted_(exact.size()) {
    const Physics& physics = window.run.physics;
    unit_s_ = 2.0 * physics.parcels.radius_m / physics.reference_speed_mps;
    for (std::uint32_t i = 0; i < exact.size(); ++i) find_difference(i, exact[i], reference[i]);
    std::sort(differences_.begin(), differences_.end(),
              [](const Difference& a, const Difference& b) { return a.time_s < b.time_s; });
    for (const Difference& difference : differences_) explain(difference);
  }

 private:
  void find_difference(std::uint32_t i, const std::vector<PartnerEvent>& exact,
                       const std::vector<PartnerEvent>& reference) {
    const std::size_t longer = std::max(exact.size(), reference.size());
    for (std::size_t k = 0; k < longer; ++k) {
      const PartnerEvent* a = k < exact.size() ? &exact[k] : nullptr;
      const PartnerEvent* b = k < reference.size() ? &reference[k] : nullptr;
      const double shift = a && b ? std::fabs(a->time_s - b->time_s) / unit_s_ : 0.0;
      if (a && b && a->partner == b->partner && shift < 1e-2) {
        result_.max_shift = std::max(result_.max_shift, shift);
        continue;
      }
      const double time_s = std::min(a ? a->time_s : b->time_s, b ? b->time_s : a->time_s);
      differences_.push_back({i, time_s, a, b});
      return;
    }
  }

  bool is_tainted(const PartnerEvent* event) const {
    if (event == nullptr) return false;
    const std::size_t body = body_of(event->partner);
    return body < tainted_.size() && tainted_[body];
  }
  std::size_t body_of(std::uint32_t partner) const {
    return partner == kBallPartner ? tainted_.size() - 1 : partner;
  }
  void taint(std::size_t body) {
    if (body < tainted_.size()) tainted_[body] = true;
  }

  void explain(const Difference& d) {
    const double tolerance_s = kTolerance * unit_s_;
    if (tainted_[d.body] || is_tainted(d.exact) || is_tainted(d.reference)) {
      ++result_.num_consequences;
    } else if (d.exact && d.reference && std::fabs(d.exact->time_s - d.reference->time_s) < tolerance_s) {
      ++result_.num_near_ties;
    } else if (std::fabs(d.time_s - window_.end_s) < tolerance_s) {
      ++result_.num_at_end;
    } else if ((d.exact && window_.grazes(d.body, d.exact->partner, d.time_s)) ||
               (d.reference && window_.grazes(d.body, d.reference->partner, d.time_s))) {
      ++result_.num_grazing;
    } else {
      ++result_.num_unexplained;
      if (result_.first_unexplained.empty()) result_.first_unexplained = describe(d);
    }
    taint(d.body);
    if (d.exact) taint(body_of(d.exact->partner));
    if (d.reference) taint(body_of(d.reference->partner));
  }

  std::string describe(const Difference& d) const {
    std::ostringstream text;
    text.precision(12);
    text << "window " << window_.start_s << " to " << window_.end_s << ", body " << d.body;
    const auto add = [&](const char* source, const PartnerEvent* event) {
      text << ", " << source << ": ";
      if (event)
        text << event->partner << " at " << event->time_s;
      else
        text << "none";
    };
    add("exact", d.exact);
    add("reference", d.reference);
    return text.str();
  }

  const Window& window_;
  MatchResult& result_;
  std::vector<bool> tainted_;
  std::vector<Difference> differences_;
  double unit_s_ = 1.0;
};

// Keeps the times of the last contacts with parcels and walls, not with the ball, for the reference's TC
// model.
void keep_contact_times(const PartnerLists& lists, std::vector<double>& last_s) {
  for (std::size_t i = 0; i < last_s.size(); ++i) {
    for (const PartnerEvent& event : lists[i]) {
      if (event.partner != kBallPartner) last_s[i] = event.time_s;
    }
  }
}

// Events of a parcel: Enskog's collisions at the current temperature, and its share of the ball's hits.
double events_per_s(const Physics& physics, const Measures& now, const BallState& ball) {
  const ParcelConstants& parcels = physics.parcels;
  const double c = std::sqrt(now.parcel_energy_j / (parcels.mass_kg * parcels.num));
  const double eta = area_fraction_of(physics);
  double rate = theory::collision_rate_per_s(eta, c, parcels.radius_m);
  if (physics.ball.exists) {
    const Vec2d half = to_metres(physics.world, physics.world.half);
    const double speed = length(ball.velocity_mps) + c;
    rate += 2.0 * (physics.ball.radius_m + parcels.radius_m) * speed / (4.0 * half.x * half.y);
  }
  return rate;
}

double ball_difference(const Physics& physics, const BallState& a, const BallState& b) {
  const Vec2d off = a.velocity_mps - b.velocity_mps;
  const double rim = std::fabs(a.spin_radps - b.spin_radps) * physics.ball.radius_m;
  return std::max(length(off), rim) / physics.reference_speed_mps;
}

}  // namespace

MatchResult match_events(SceneRun& run, const MatchPlan& plan) {
  MatchResult result;
  const Physics& physics = run.physics;
  const std::uint32_t num = physics.parcels.num;
  const double tick_s = tick_seconds(physics.world, physics.reference_speed_mps);
  std::vector<double> last_s(num, -1e30);
  BallState ball = run.ball;
  double requested_s = plan.flown_s;
  for (int k = 0; k < plan.num_windows; ++k) {
    const Measures before = run.backend->measure();
    if (before.num_live == 0) break;
    const double window_s = plan.collisions_per_window / events_per_s(physics, before, ball);
    Window window{run, physics, {}, ball, 0.0, 0.0};
    window.start_s = std::round(requested_s / tick_s) * tick_s;
    requested_s += window_s;
    window.end_s = std::round(requested_s / tick_s) * tick_s;
    if (plan.wrong_radius_m > 0.0) window.physics.parcels.radius_m = plan.wrong_radius_m;
    window.parcels = reference_parcels(physics.world, run.backend->snapshot());
    for (std::uint32_t i = 0; i < num; ++i) window.parcels[i].last_event_s = last_s[i] - window.start_s;

    std::vector<EventRecord> events;
    StepRequest request =
        step_request(run.settings, physics, plan.steps_per_window, window_s / plan.steps_per_window);
    request.events = &events;
    ball = run.backend->advance(request).ball;

    Reference reference = window.reference();
    std::vector<ReferenceEvent> expected;
    reference.run_until(window.end_s - window.start_s, &expected);

    const PartnerLists exact_lists = lists_of(events, num, tick_s);
    const std::uint64_t differed = result.num_differences();
    Comparison(window, exact_lists, lists_of(expected, num, window.start_s), result);
    if (physics.ball.exists && result.num_differences() == differed) {
      reference.apply_ball_impulses();
      const double off = ball_difference(physics, reference.ball(), ball);
      result.max_ball_difference = std::max(result.max_ball_difference, off);
    }
    keep_contact_times(exact_lists, last_s);
    result.num_events += expected.size();
    ++result.num_windows;
  }
  return result;
}

}  // namespace pf::test
