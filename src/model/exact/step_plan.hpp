// Method `exact` between steps: the length of a step, the bound on speeds that its safety rests on, and the
// ball's trajectory through it. Host and device code.
#pragma once

#include <cstdint>

#include "model/exact/collision.hpp"

namespace pf {

// State of the run at the start of a step.
struct ExactProgress {
  std::uint64_t now = 0;              // ticks of the reference speed since the reset
  std::uint32_t tick_exponent = 0;    // a tick of steps and trajectories lasts 2^tick_exponent of these
  std::int64_t max_displacement = 0;  // bound on displacements along an axis since the sort, position units
  double units_since_sort = 0.0;      // position units that 1 m/s has covered since the sort
  double roundings_since_sort = 0.0;  // position units
  double fastest_mps = 0.0;           // bound on the parcels' speeds now
  double raised_bound_mps = 0.0;      // after a step in which a speed exceeded the bound; 0: none
  double preferred_ticks = 0.0;       // length of a step with a preferred number of events; 0: unknown
  BallState ball;
  BallTrajectory ball_trajectory;      // since its last event, of a ball that flies straight
  bool ball_trajectory_holds = false;  // whether ball_trajectory is valid
};

// The ball through a step.
struct ExactBall {
  BallTrajectory trajectory;
  Vec2d end_velocity_mps;  // at the end of the step if nothing hits it
};

// Factor from the largest speed now to the bound on speeds in the step. Exceeding the bound is rare and costs
// a repeated step. (Two parcels of equal speed leave each with at most sqrt(2) times that speed.)
constexpr double kSpeedMargin = 1.2;
constexpr double kMaxReach = 1.0e9;  // position units; a search box must stay within 32 bits

// Role of the ball in a step of dt_s. It is frozen if its hits change it by less than 1e-6 of their effect:
// 2 m / m_b times the number of hits expected.
PF_HD inline BallRole ball_role(const Physics& physics, const BallState& ball, double dt_s) {
  constexpr double kNegligible = 1e-6;
  if (!physics.ball.exists) return BallRole::absent;
  if (physics.ball.held) return BallRole::frozen;
  const double speed_mps = length(ball.velocity_mps) + physics.parcels.speed_mps;
  const double contact_m = physics.ball.radius_m + physics.parcels.radius_m;
  const double hits = 2.0 * contact_m * speed_mps * dt_s * physics.parcels.num / area_m2(physics.world);
  const double change = 2.0 * physics.parcels.mass_kg / physics.ball.mass_kg * hits;
  return change < kNegligible ? BallRole::frozen : BallRole::participant;
}

// Speed of the fastest point of the ball: a parcel that it hits may become that fast. Ball: BallState or
// BallTrajectory. factor: of the speed of its centre.
template <class Ball>
PF_HD inline double surface_speed_mps(const Physics& physics, const Ball& ball, double factor = 1.0) {
  const double spin = ball.spin_radps < 0.0 ? -ball.spin_radps : ball.spin_radps;
  return factor * length(ball.velocity_mps) + spin * physics.ball.radius_m;
}

// Bound on the speeds that current speeds and hits by the ball can lead to. reference_mps: of the step's
// ticks. ball_factor: a hit is assumed to give a parcel at most so many times the ball's speed.
PF_HD inline double assumed_bound_mps(const Physics& physics, double reference_mps,
                                      const ExactProgress& progress, double ball_factor) {
  double fastest = 1e-3 * reference_mps;
  if (progress.fastest_mps > fastest) fastest = progress.fastest_mps;
  if (physics.ball.exists) {
    const double surface = surface_speed_mps(physics, progress.ball, ball_factor);
    if (surface > fastest) fastest = surface;
  }
  const double bound = kSpeedMargin * fastest;
  return bound > progress.raised_bound_mps ? bound : progress.raised_bound_mps;
}

// True if parcels are so large that boxes around them would not stay within 32 bits. Such parcels are few,
// and every pair is tested.
PF_HD inline bool needs_all_pairs(const RunConstants& run) { return run.contact_distance > 0.25 * kMaxReach; }

// Longest safe step, in ticks: search boxes stay within 32 bits, and in a periodic world only nearest images
// can collide. Boxes grow with the displacement since the sort; without contacts there are none. Elsewhere a
// position that is traced back to the step's start may lie beyond an edge, by as much as a parcel moves.
PF_HD inline std::uint32_t max_step_ticks(const ExactConstants& c, std::int64_t max_displacement) {
  const World& world = c.run.physics.world;
  const double anywhere = 8.0 * kMaxReach;
  const double ball_contact = c.plan.ball != BallRole::absent ? c.run.ball_contact : 0.0;
  const bool boxes = c.run.physics.parcels.contacts && !needs_all_pairs(c.run);
  double room = anywhere;
  if (boxes) room = kMaxReach - static_cast<double>(max_displacement) - c.run.contact_distance;
  if (needs_all_pairs(c.run)) room = c.run.contact_distance;  // parcels stay so far within the world
  if (ball_contact > 0.0 && kMaxReach - ball_contact < room) room = kMaxReach - ball_contact;
  if (world.boundary == Boundary::periodic) {
    const double widest = ball_contact > c.run.contact_distance ? ball_contact : c.run.contact_distance;
    const double narrower = world.half.x < world.half.y ? world.half.x : world.half.y;
    if (narrower - widest < room) room = narrower - widest;
  }
  const double ways = world.boundary == Boundary::periodic ? 2.0 : 3.0;
  const double ticks = (room - 2.0 * kRoundingMargin) / (ways * c.plan.max_speed_mps * c.plan.units_per_tick);
  const auto limit = static_cast<double>(kAnchorPeriod);
  return static_cast<std::uint32_t>(ticks < 1.0 ? 1.0 : (ticks > limit ? limit : ticks));
}

// Number of events that a step should have. With many more, clusters become so large that few are solved in
// parallel; with many fewer, most of the work is spent on parcels that have no event.
PF_HD inline double preferred_num_events(const Physics& physics) { return 0.1 * physics.parcels.num + 64.0; }

// Length of a step with the preferred number of events, ticks. Before the first step the rate of events is
// bounded by that of discs that all move at the largest speed.
PF_HD inline double preferred_ticks(const ExactConstants& c, const ExactProgress& progress) {
  if (progress.preferred_ticks > 0.0) return progress.preferred_ticks;
  const Physics& physics = c.run.physics;
  const World& world = physics.world;
  const double swept = 2.0 * c.run.contact_distance * progress.fastest_mps * c.plan.units_per_tick;
  const double share = physics.parcels.num * swept / (4.0 * world.half.x * world.half.y);
  const double events = 0.5 * share * physics.parcels.num;
  const double ticks =
      events > 0.0 ? preferred_num_events(physics) / events : static_cast<double>(kAnchorPeriod);
  return ticks < 1.0 ? 1.0 : ticks;
}

// The same after a step of `length` ticks that had num_events.
PF_HD inline double preferred_ticks(const Physics& physics, std::uint32_t length, std::uint64_t num_events) {
  const double longer = preferred_num_events(physics) / (static_cast<double>(num_events) + 1.0);
  const double ticks = length * (longer < 16.0 ? longer : 16.0);
  return ticks < 1.0 ? 1.0 : ticks;
}

// A gas that cools becomes slow against its ticks, until little happens within an anchor period. Its ticks
// are then made longer by a power of two, as if the reference speed were lower.

// Largest speed that suits ticks of 2^exponent: it covers the same part of a position unit as the reference
// speed.
PF_HD inline double tick_speed_mps(const TickScale& reference, std::uint32_t exponent) {
  return 1.0 / (8.0 * reference.units_per_tick * static_cast<double>(1ULL << exponent));
}

// Exponent of the ticks from now on, a moment at which every trajectory is anchored anew. fastest_mps:
// exactly the largest speed of parcels and ball, so that the result depends on nothing else. The exponent
// stays while that speed lies between a 64th of the ticks' speed and all of it.
PF_HD inline std::uint32_t choose_tick_exponent(const TickScale& reference, std::uint32_t exponent,
                                                double fastest_mps) {
  const double speed = tick_speed_mps(reference, exponent);
  const bool fits = fastest_mps <= speed && fastest_mps >= 0x1p-6 * speed;
  if (fits || fastest_mps == 0.0) return exponent;
  // Starts of steps are whole ticks, so at most 30 bits are dropped at once.
  const std::uint32_t limit = exponent + 30 < kMaxTickExponent ? exponent + 30 : kMaxTickExponent;
  std::uint32_t best = 0;
  while (best < limit && tick_speed_mps(reference, best + 1) >= 2.0 * fastest_mps) ++best;
  return best;
}

// The same scale for ticks 2^exponent times as long.
PF_HD inline TickScale scaled(const TickScale& reference, std::uint32_t exponent) {
  if (exponent == 0) return reference;
  TickScale scale = reference;
  const auto factor = static_cast<double>(1ULL << exponent);
  scale.tick_s *= factor;
  scale.units_per_tick *= factor;
  scale.min_separation_speed_mps /= factor;
  scale.separation_mps_per_unit /= factor;
  scale.reference_speed_mps /= factor;
  scale.contact_duration_ticks = static_cast<std::uint32_t>(
      (reference.contact_duration_ticks + (1ULL << exponent) - 1) >> exponent);  // zero stays zero
  return scale;
}

// Tick of a parcel's last contact in ticks of another exponent; now: in ticks of the reference speed. A
// contact older than an anchor period stays older.
PF_HD inline std::uint32_t rescaled_contact_tick(std::uint32_t tick, std::uint64_t now, std::uint32_t from,
                                                 std::uint32_t to) {
  const std::uint64_t longest = kAnchorPeriod;
  std::uint64_t age = static_cast<std::uint32_t>(now >> from) - tick;
  if (to >= from)
    age = age < longest ? (age + (1ULL << (to - from)) - 1) >> (to - from) : longest;
  else
    age = age <= longest >> (from - to) ? age << (from - to) : longest;
  return static_cast<std::uint32_t>((now >> to) - age);
}

PF_HD inline bool is_at_anchoring(const ExactProgress& progress) {
  return (progress.now >> progress.tick_exponent) % kAnchorPeriod == 0;
}

// Ticks from now to the next moment at which trajectories are anchored anew: at least one.
PF_HD inline std::uint64_t ticks_to_anchoring(const ExactProgress& progress) {
  return kAnchorPeriod - (progress.now >> progress.tick_exponent) % kAnchorPeriod;
}

// Ticks from now to the end of the one that contains `until`, which is later than now. until: ticks of the
// reference speed.
PF_HD inline std::uint64_t ticks_until(const ExactProgress& progress, std::uint64_t until) {
  return ((until - progress.now - 1) >> progress.tick_exponent) + 1;
}

// The same, or those to the next anchoring if that comes first.
PF_HD inline std::uint64_t ticks_until_anchoring_or(const ExactProgress& progress, std::uint64_t until) {
  const std::uint64_t asked = ticks_until(progress, until), to_anchoring = ticks_to_anchoring(progress);
  return asked < to_anchoring ? asked : to_anchoring;
}

// An empty plan that starts now.
PF_HD inline StepPlan plan_of_now(const RunConstants& run, const ExactProgress& progress) {
  StepPlan plan;
  static_cast<TickScale&>(plan) = scaled(run.reference_ticks, progress.tick_exponent);
  plan.start = static_cast<std::uint32_t>(progress.now >> progress.tick_exponent);
  return plan;
}

// Plans the step that starts now and ends at the latest in the tick of `until`, at most max_ticks long. It
// ends where trajectories are anchored anew.
PF_HD inline StepPlan plan_step(const RunConstants& run, const ExactProgress& progress, std::uint64_t until,
                                std::uint32_t max_ticks) {
  ExactConstants c{run, plan_of_now(run, progress)};
  const std::uint64_t wanted = ticks_until_anchoring_or(progress, until);
  const double parts = static_cast<double>(wanted) / preferred_ticks(c, progress);  // equal ones
  const std::uint64_t num = parts > 1.0 ? static_cast<std::uint64_t>(parts) + 1 : 1;
  const std::uint64_t part = (wanted + num - 1) / num;
  c.plan.length = part < max_ticks ? static_cast<std::uint32_t>(part) : max_ticks;
  c.plan.max_speed_mps = assumed_bound_mps(run.physics, c.plan.reference_speed_mps, progress, 2.0);
  c.plan.ball = ball_role(run.physics, progress.ball, c.plan.length * c.plan.tick_s);
  const std::uint32_t possible = max_step_ticks(c, progress.max_displacement);
  if (possible < c.plan.length) c.plan.length = possible;
  return c.plan;
}

PF_HD inline bool flies_straight(const BallConstants& ball, double spin_radps) {
  return ball.held || (ball.magnus_per_rad * spin_radps == 0.0 && ball.drag_per_m == 0.0);
}

// The ball at the step's start. A ball that flies straight keeps its trajectory; any other moves along the
// chord of its arc.
PF_HD inline ExactBall ball_in_step(const ExactConstants& c, const ExactProgress& progress) {
  const Physics& physics = c.run.physics;
  const BallState& ball = progress.ball;
  if (c.plan.ball == BallRole::absent) return {};
  const bool straight = flies_straight(physics.ball, ball.spin_radps);
  if (straight && progress.ball_trajectory_holds && !physics.ball.held)
    return {progress.ball_trajectory, ball.velocity_mps};
  BallTrajectory trajectory;
  trajectory.anchor_units = ball.position_m * (1.0 / physics.world.unit_m);
  trajectory.spin_radps = ball.spin_radps;
  if (physics.ball.held) return {trajectory, {}};
  if (straight) {
    trajectory.velocity_mps = ball.velocity_mps;
    return {trajectory, ball.velocity_mps};
  }
  const double dt_s = c.plan.length * c.plan.tick_s;
  const BallFlight flight = fly(physics.ball, ball, dt_s);
  trajectory.velocity_mps = flight.displacement_m * (1.0 / dt_s);
  return {trajectory, flight.velocity_mps};
}

// A circle around the ball's centre at the step's start that holds every parcel that may hit it in the step.
struct BallNeighbourhood {
  Vec2i centre{};           // position units
  std::int32_t radius = 0;  // position units
};

PF_HD inline BallNeighbourhood neighbourhood_of(const ExactConstants& c, const BallTrajectory& ball) {
  const double moved = c.plan.max_speed_mps * c.plan.units_per_tick * c.plan.length;
  const World& world = c.run.physics.world;
  Vec2d centre = ball.anchor_units +
                 displacement_units(c.plan, ball.velocity_mps, -static_cast<std::int64_t>(ball.tick));
  if (world.boundary == Boundary::periodic) centre = nearest_image<Boundary::periodic>(world, centre);
  const double radius = c.run.ball_contact + 2.0 * moved + kRoundingMargin;
  return {{saturated_units(centre.x), saturated_units(centre.y)},
          static_cast<std::int32_t>(radius < kMaxReach ? radius : kMaxReach)};
}

// position: of a parcel at the step's start.
template <Boundary kBoundary>
PF_HD inline bool is_in(const BallNeighbourhood& ball, const World& world, Vec2i position) {
  const Vec2i from = separation<kBoundary>(world, ball.centre, position);
  const std::int64_t x = from.x, y = from.y;
  if ((x < 0 ? -x : x) > ball.radius || (y < 0 ? -y : y) > ball.radius) return false;
  return squared(from.x) + squared(from.y) <= squared(ball.radius);
}

// Applies the ball's event at `tick`: a hit, which has a reaction, or a wall, which is the partner.
PF_HD inline void apply_to_ball(const ExactConstants& c, std::uint32_t tick, std::uint32_t partner,
                                const BallReaction& reaction, ExactBall& ball) {
  const Physics& physics = c.run.physics;
  BallTrajectory& trajectory = ball.trajectory;
  trajectory.anchor_units +=
      displacement_units(c.plan, trajectory.velocity_mps, static_cast<std::int64_t>(tick) - trajectory.tick);
  trajectory.tick = static_cast<std::int32_t>(tick);
  const Vec2d change = reaction.velocity_mps * (physics.parcels.mass_kg / physics.ball.mass_kg);
  trajectory.velocity_mps += change;
  ball.end_velocity_mps += change;
  trajectory.spin_radps +=
      reaction.spin_mps * (physics.parcels.mass_kg * physics.ball.radius_m / physics.ball.inertia_kg_m2);
  if (partner == kWallX) {
    trajectory.velocity_mps.x = -trajectory.velocity_mps.x;
    ball.end_velocity_mps.x = -ball.end_velocity_mps.x;
  }
  if (partner == kWallY) {
    trajectory.velocity_mps.y = -trajectory.velocity_mps.y;
    ball.end_velocity_mps.y = -ball.end_velocity_mps.y;
  }
}

// Sums over a solved step that the next one is planned from.
struct StepResult {
  BallSums frozen_hits;               // impulses on a frozen ball, counts of impulse_unit_kg_mps
  double fastest_at_start_mps = 0.0;  // largest speed of a parcel
  double fastest_after_mps = 0.0;     // largest speed of a parcel after an event
  std::uint64_t num_events = 0;
};

// Moves the ball to the end of the step. ball: after the step's events. progress: already at the end
// otherwise.
PF_HD inline void finish_ball(const ExactConstants& c, const ExactBall& ball, const BallSums& frozen_hits,
                              ExactProgress& progress) {
  const Physics& physics = c.run.physics;
  BallState& state = progress.ball;
  const BallTrajectory& trajectory = ball.trajectory;
  const std::int64_t flown = static_cast<std::int64_t>(c.plan.length) - trajectory.tick;
  state.position_m = (trajectory.anchor_units + displacement_units(c.plan, trajectory.velocity_mps, flown)) *
                     physics.world.unit_m;
  state.velocity_mps = ball.end_velocity_mps;
  state.spin_radps = trajectory.spin_radps;
  if (c.plan.ball == BallRole::frozen)
    apply_hits(physics.ball, frozen_hits, c.run.impulse_unit_kg_mps, state);
  state.angle_rad += state.spin_radps * (c.plan.length * c.plan.tick_s);
  progress.ball_trajectory = trajectory;
  progress.ball_trajectory.tick -= static_cast<std::int32_t>(c.plan.length);
  // The walls of a ball that flies straight are events, of which one may be due at this very tick. In a
  // periodic world its trajectory goes on beyond the edge, until the next anchoring.
  const bool goes_on = c.plan.ball == BallRole::participant && flies_straight(physics.ball, state.spin_radps);
  if (!goes_on || physics.world.boundary == Boundary::periodic)
    apply_boundary_to_ball(physics.world, physics.ball.radius_m, state);
  progress.ball_trajectory_holds = goes_on && !is_at_anchoring(progress);
}

// Moves time and the bounds on displacements and speeds to the end of a solved step.
PF_HD inline void advance_progress(const ExactConstants& c, const StepResult& result,
                                   ExactProgress& progress) {
  const double after = result.fastest_after_mps, at_start = result.fastest_at_start_mps;
  const double fastest = after > progress.fastest_mps ? after : progress.fastest_mps;
  constexpr int kRounding = 3;  // position units
  const double units = c.plan.units_per_tick * c.plan.length;
  progress.max_displacement += static_cast<std::int64_t>(fastest * units) + kRounding;
  progress.units_since_sort += units;
  progress.roundings_since_sort += kRounding;
  progress.fastest_mps = after > at_start ? after : at_start;
  progress.raised_bound_mps = 0.0;
  progress.preferred_ticks = preferred_ticks(c.run.physics, c.plan.length, result.num_events);
  progress.now += static_cast<std::uint64_t>(c.plan.length) << progress.tick_exponent;
}

}  // namespace pf
