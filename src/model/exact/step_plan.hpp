// Method `exact` between steps: how long a step may be, the bound on speeds that its safety rests on, and the
// ball's line through it. Text for host and device.
#pragma once

#include <cstdint>

#include "model/exact/trajectory.hpp"

namespace pf {

// What is known at the begin of a step.
struct ExactProgress {
  std::uint64_t now = 0;          // ticks of the reference speed since the reset
  std::uint32_t coarse = 0;       // the ticks that lines and steps are counted in are 2^coarse of these
  std::int64_t travel = 0;        // bound on displacements along an axis since the sort, position units
  double fastest_mps = 0.0;       // bound on the parcels' present speeds
  double raised_bound_mps = 0.0;  // after a step in which something was faster than assumed; 0: none
  double preferred_ticks = 0.0;   // length of a step with about as many events as suit the method; 0: unknown
  BallState ball;
  BallLine ball_line;         // of a ball that flies straight, from its last event on
  bool ball_follows = false;  // whether ball_line holds
};

// The ball through a step.
struct ExactBall {
  BallLine line;
  Vec2d end_velocity_mps;  // at the end of the step if nothing hits it
};

// What follows from the present speeds for the step: more is rare, and costs a step done again. (Two parcels
// of equal speed cannot leave one of them with more than sqrt(2) times that.)
constexpr double kSpeedMargin = 1.2;
constexpr double kLongestReach = 1.0e9;  // position units; a search box must stay within 32 bits

// How the ball takes part in a step: frozen if what its hits change of it is below 1e-6 of what they are, 2
// (m / m_b) times the hits expected in dt_s.
PF_HD inline BallRole ball_role(const Physics& physics, const BallState& ball, double dt_s) {
  constexpr double kNegligible = 1e-6;
  if (!physics.ball.present) return BallRole::absent;
  if (physics.ball.held) return BallRole::frozen;
  const World& world = physics.world;
  const double area_m2 = 4.0 * world.half.x * world.unit_m * (world.half.y * world.unit_m);
  const double speed_mps = speed_of(ball.velocity_mps) + physics.parcels.speed_mps;
  const double contact_m = physics.ball.radius_m + physics.parcels.radius_m;
  const double hits = 2.0 * contact_m * speed_mps * dt_s * physics.parcels.num / area_m2;
  const double change = 2.0 * physics.parcels.mass_kg / physics.ball.mass_kg * hits;
  return change < kNegligible ? BallRole::frozen : BallRole::participant;
}

// Bound on whatever may come of present speeds and of a hit by the ball.
PF_HD inline double assumed_bound_mps(const Physics& physics, const ExactProgress& progress) {
  double fastest = 1e-3 * physics.reference_speed_mps;
  if (progress.fastest_mps > fastest) fastest = progress.fastest_mps;
  if (physics.ball.present) {
    const double spin = progress.ball.spin_radps < 0.0 ? -progress.ball.spin_radps : progress.ball.spin_radps;
    const double surface = 2.0 * speed_of(progress.ball.velocity_mps) + spin * physics.ball.radius_m;
    if (surface > fastest) fastest = surface;
  }
  const double bound = kSpeedMargin * fastest;
  return bound > progress.raised_bound_mps ? bound : progress.raised_bound_mps;
}

// Parcels so large that boxes around them would not stay within 32 bits are few: every pair is looked at.
PF_HD inline bool needs_all_pairs(const ExactConstants& c) {
  return c.step.contact_distance > 0.25 * kLongestReach;
}

// Search boxes stay within 32 bits, and a periodic world is so wide that only nearest images can meet. Boxes
// of parcels grow with what was travelled since the sort; without contacts there are none.
PF_HD inline std::uint32_t longest_step(const ExactConstants& c, std::int64_t travel) {
  const World& world = c.step.physics.world;
  const double anywhere = 8.0 * kLongestReach;
  const double ball_contact = c.ball != BallRole::absent ? c.ball_contact : 0.0;
  const bool boxes = c.step.physics.parcels.contacts && !needs_all_pairs(c);
  double room = boxes ? kLongestReach - static_cast<double>(travel) - c.step.contact_distance : anywhere;
  if (ball_contact > 0.0 && kLongestReach - ball_contact < room) room = kLongestReach - ball_contact;
  if (world.boundary == Boundary::periodic) {
    const double widest = ball_contact > c.step.contact_distance ? ball_contact : c.step.contact_distance;
    const double narrower = world.half.x < world.half.y ? world.half.x : world.half.y;
    if (narrower - widest < room) room = narrower - widest;
  }
  const double ticks = (room - 2.0 * kRoundingMargin) / (2.0 * c.max_speed_mps * c.units_per_tick);
  const auto most = static_cast<double>(kAnchorPeriod);
  return static_cast<std::uint32_t>(ticks < 1.0 ? 1.0 : (ticks > most ? most : ticks));
}

// Events that a step should have: with many more, they hang together in clusters so large that few can be
// solved side by side; with many fewer, most of the step is looking at parcels that nothing happens to.
PF_HD inline double suitable_events(const Physics& physics) { return 0.1 * physics.parcels.num + 64.0; }

// Length of a step with about that many, ticks; before the first step from a bound on the rate, that of discs
// that all are as fast as the fastest.
PF_HD inline double preferred_ticks(const ExactConstants& c, const ExactProgress& progress) {
  if (progress.preferred_ticks > 0.0) return progress.preferred_ticks;
  const Physics& physics = c.step.physics;
  const World& world = physics.world;
  const double swept = 2.0 * c.step.contact_distance * progress.fastest_mps * c.units_per_tick;
  const double share = physics.parcels.num * swept / (4.0 * world.half.x * world.half.y);
  const double events = 0.5 * share * physics.parcels.num;
  const double ticks = events > 0.0 ? suitable_events(physics) / events : static_cast<double>(kAnchorPeriod);
  return ticks < 1.0 ? 1.0 : ticks;
}

// After a step of `length` ticks with num_events.
PF_HD inline double preferred_ticks(const Physics& physics, std::uint32_t length, std::uint64_t num_events) {
  const double longer = suitable_events(physics) / (static_cast<double>(num_events) + 1.0);
  const double ticks = length * (longer < 16.0 ? longer : 16.0);
  return ticks < 1.0 ? 1.0 : ticks;
}

// A gas that cools becomes slow against its ticks, until little happens from one anchoring to the next. So
// ticks become coarser then: what was slow is a gas of a lower reference speed.

constexpr std::uint32_t kMostCoarse = 40;

// Largest speed of ticks 2^coarse times as long: the same part of a position unit as the reference speed's.
PF_HD inline double tick_speed_mps(const ExactConstants& c, std::uint32_t coarse) {
  return 1.0 / (8.0 * c.units_per_tick * static_cast<double>(1ULL << coarse));
}

// What the ticks are to be from the present moment on, at which every line is anchored anew. c: of the ticks
// of the reference speed. fastest_mps: exactly the largest speed of parcels and ball now, so that this
// depends on nothing else. Where it is between a 64th of the ticks' speed and all of it, they stay as they
// are.
PF_HD inline std::uint32_t suitable_coarseness(const ExactConstants& c, std::uint32_t coarse,
                                               double fastest_mps) {
  const double speed = tick_speed_mps(c, coarse);
  const bool fits = fastest_mps <= speed && fastest_mps >= 0x1p-6 * speed;
  if (fits || fastest_mps == 0.0) return coarse;
  const std::uint32_t most = coarse + 30 < kMostCoarse ? coarse + 30 : kMostCoarse;  // begins are whole ticks
  std::uint32_t best = 0;
  while (best < most && tick_speed_mps(c, best + 1) >= 2.0 * fastest_mps) ++best;
  return best;
}

// The same constants for ticks 2^coarse times as long.
PF_HD inline ExactConstants coarsened(const ExactConstants& base, std::uint32_t coarse) {
  if (coarse == 0) return base;
  ExactConstants c = base;
  const auto factor = static_cast<double>(1ULL << coarse);
  c.tick_s *= factor;
  c.units_per_tick *= factor;
  c.least_parting_mps /= factor;
  c.step.physics.reference_speed_mps /= factor;
  c.clock_ticks =
      static_cast<std::uint32_t>((base.clock_ticks + (1ULL << coarse) - 1) >> coarse);  // none stays none
  return c;
}

// Since when a parcel's contact clock runs, counted in ticks of another length; now: the moment in both. What
// is older than an anchoring stays so.
PF_HD inline std::uint32_t clock_in_ticks(std::uint32_t clock, std::uint64_t now, std::uint32_t from,
                                          std::uint32_t to) {
  const std::uint64_t longest = kAnchorPeriod;
  std::uint64_t age = static_cast<std::uint32_t>(now >> from) - clock;
  if (to >= from)
    age = age < longest ? (age + (1ULL << (to - from)) - 1) >> (to - from) : longest;
  else
    age = age <= longest >> (from - to) ? age << (from - to) : longest;
  return static_cast<std::uint32_t>((now >> to) - age);
}

PF_HD inline bool is_at_anchoring(const ExactProgress& progress) {
  return (progress.now >> progress.coarse) % kAnchorPeriod == 0;
}

// Fills begin, length, bound and role of the step that starts now and ends in the tick of `until` at the
// latest, at most `longest` ticks long. It ends where all lines are anchored anew. c: coarsened.
PF_HD inline void plan_step(const ExactProgress& progress, std::uint64_t until, std::uint32_t longest,
                            ExactConstants& c) {
  const std::uint64_t begin = progress.now >> progress.coarse;
  const std::uint64_t asked = ((until - progress.now - 1) >> progress.coarse) + 1;
  c.begin = static_cast<std::uint32_t>(begin);
  const std::uint64_t to_anchoring = kAnchorPeriod - begin % kAnchorPeriod;
  const std::uint64_t wanted = asked < to_anchoring ? asked : to_anchoring;
  const double parts = static_cast<double>(wanted) / preferred_ticks(c, progress);  // equal ones
  const std::uint64_t num = parts > 1.0 ? static_cast<std::uint64_t>(parts) + 1 : 1;
  const std::uint64_t part = (wanted + num - 1) / num;
  c.length = part < longest ? static_cast<std::uint32_t>(part) : longest;
  c.max_speed_mps = assumed_bound_mps(c.step.physics, progress);
  c.ball = ball_role(c.step.physics, progress.ball, c.length * c.tick_s);
  const std::uint32_t possible = longest_step(c, progress.travel);
  if (possible < c.length) c.length = possible;
}

PF_HD inline bool flies_straight(const BallConstants& ball, double spin_radps) {
  return ball.held || (ball.magnus_per_rad * spin_radps == 0.0 && ball.drag_per_m == 0.0);
}

// The ball's line through the step: of a straight flight the one that it is on, else the chord of its arc.
PF_HD inline ExactBall ball_in_step(const ExactConstants& c, const ExactProgress& progress) {
  const Physics& physics = c.step.physics;
  const BallState& ball = progress.ball;
  if (c.ball == BallRole::absent) return {};
  const bool straight = flies_straight(physics.ball, ball.spin_radps);
  if (straight && progress.ball_follows) return {progress.ball_line, ball.velocity_mps};
  BallLine line;
  line.anchor_units = ball.position_m * (1.0 / physics.world.unit_m);
  line.spin_radps = ball.spin_radps;
  if (physics.ball.held) return {line, {}};
  if (straight) {
    line.velocity_mps = ball.velocity_mps;
    return {line, ball.velocity_mps};
  }
  const double dt_s = c.length * c.tick_s;
  const BallFlight flight = fly(physics.ball, ball, dt_s);
  line.velocity_mps = flight.displacement_m * (1.0 / dt_s);
  return {line, flight.velocity_mps};
}

// What the ball's own event at `tick` does to it: a hit (kick) or a wall (partner).
PF_HD inline void change_ball(const ExactConstants& c, std::uint32_t tick, std::uint32_t partner,
                              const BallKick& kick, ExactBall& ball) {
  const Physics& physics = c.step.physics;
  BallLine& line = ball.line;
  line.anchor_units += travelled(c, line.velocity_mps, static_cast<std::int64_t>(tick) - line.tick);
  line.tick = static_cast<std::int32_t>(tick);
  const Vec2d change = kick.velocity_mps * (physics.parcels.mass_kg / physics.ball.mass_kg);
  line.velocity_mps += change;
  ball.end_velocity_mps += change;
  line.spin_radps +=
      kick.spin_mps * (physics.parcels.mass_kg * physics.ball.radius_m / physics.ball.inertia_kg_m2);
  if (partner == kWallX) {
    line.velocity_mps.x = -line.velocity_mps.x;
    ball.end_velocity_mps.x = -ball.end_velocity_mps.x;
  }
  if (partner == kWallY) {
    line.velocity_mps.y = -line.velocity_mps.y;
    ball.end_velocity_mps.y = -ball.end_velocity_mps.y;
  }
}

// Fastest point of the ball: the bound on speeds must hold for what it hits, too.
PF_HD inline double surface_speed_mps(const Physics& physics, const BallLine& line) {
  const double spin = line.spin_radps < 0.0 ? -line.spin_radps : line.spin_radps;
  return speed_of(line.velocity_mps) + spin * physics.ball.radius_m;
}

PF_HD inline double surface_speed_mps(const Physics& physics, const BallState& ball) {
  const double spin = ball.spin_radps < 0.0 ? -ball.spin_radps : ball.spin_radps;
  return speed_of(ball.velocity_mps) + spin * physics.ball.radius_m;
}

// The step is done: time, travel and ball move on. frozen_hits: what a frozen ball took (counts of
// c.step.impulse_unit_kg_mps). fastest_*: largest speeds of parcels, at the begin and after events.
// num_events: of the step.
PF_HD inline void end_step(const ExactConstants& c, const ExactBall& ball, const BallSums& frozen_hits,
                           double fastest_at_begin_mps, double fastest_after_mps, std::uint64_t num_events,
                           ExactProgress& progress) {
  const Physics& physics = c.step.physics;
  const double fastest = fastest_after_mps > progress.fastest_mps ? fastest_after_mps : progress.fastest_mps;
  progress.travel += static_cast<std::int64_t>(fastest * c.units_per_tick * c.length) + 3;
  progress.fastest_mps = fastest_after_mps > fastest_at_begin_mps ? fastest_after_mps : fastest_at_begin_mps;
  progress.raised_bound_mps = 0.0;
  progress.preferred_ticks = preferred_ticks(physics, c.length, num_events);
  progress.now += static_cast<std::uint64_t>(c.length) << progress.coarse;
  if (c.ball == BallRole::absent || physics.ball.held) return;
  BallState& state = progress.ball;
  const BallLine& line = ball.line;
  const std::int64_t flown = static_cast<std::int64_t>(c.length) - line.tick;
  state.position_m = (line.anchor_units + travelled(c, line.velocity_mps, flown)) * physics.world.unit_m;
  state.velocity_mps = ball.end_velocity_mps;
  state.spin_radps = line.spin_radps;
  if (c.ball == BallRole::frozen) {
    const double per_mass = c.step.impulse_unit_kg_mps / physics.ball.mass_kg;
    state.velocity_mps += Vec2d{static_cast<double>(frozen_hits.impulse_x) * per_mass,
                                static_cast<double>(frozen_hits.impulse_y) * per_mass};
    state.spin_radps += static_cast<double>(frozen_hits.torque) *
                        (c.step.impulse_unit_kg_mps * physics.ball.radius_m / physics.ball.inertia_kg_m2);
  }
  state.angle_rad += state.spin_radps * (c.length * c.tick_s);
  progress.ball_line = line;
  progress.ball_line.tick -= static_cast<std::int32_t>(c.length);
  const Vec2d before = state.position_m;
  apply_boundary_to_ball(physics.world, physics.ball.radius_m, state);
  progress.ball_follows = c.ball == BallRole::participant && flies_straight(physics.ball, state.spin_radps) &&
                          before.x == state.position_m.x && before.y == state.position_m.y &&
                          !is_at_anchoring(progress);
}

}  // namespace pf
