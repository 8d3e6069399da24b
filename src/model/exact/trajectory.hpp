// Method `exact`: straight trajectories of parcels and ball between events, and the constants of a step.
//
// Time is counted in ticks, an integer. A trajectory is anchored at its parcel's last event and evaluated
// from there. An event's tick therefore depends neither on how time is cut into steps nor on where parcels
// lie in memory. Within a step, ticks count from the step's start. Host and device code.
#pragma once

#include <cstdint>
#include <limits>

#include "model/parcel.hpp"

namespace pf {

// All trajectories are anchored anew when the tick is a multiple of this period. It is fixed, so that it does
// not depend on the steps, and short enough for ages to fit 31 bits.
constexpr std::uint64_t kAnchorPeriod = 1ULL << 30U;

// In a gas that has cooled a tick of the trajectories lasts 2^exponent ticks of the reference speed.
constexpr std::uint32_t kMaxTickExponent = 40;

// Position units by which a computed position may differ from the stored one: two roundings of a position and
// one of a tick for each body.
constexpr double kRoundingMargin = 4.0;

// The velocity with which a parcel enters the method: one that counts as not finite becomes NaN, with which
// no parcel meets another.
PF_HD inline Vec2f entering_velocity(Vec2f velocity) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  return dot(velocity, velocity) < kMaxFiniteSpeed2 ? velocity : Vec2f{kNan, kNan};
}

struct Trajectory {
  Vec2i anchor;            // position units
  Vec2f velocity;          // m/s
  std::uint32_t tick = 0;  // time of the anchor, modulo 2^32
};

// The ball's trajectory within a step, in double precision.
struct BallTrajectory {
  Vec2d anchor_units;
  Vec2d velocity_mps;  // of the chord of its arc
  double spin_radps = 0.0;
  std::int32_t tick = 0;  // time of the anchor, counted from the step's start
};

enum class BallRole : std::uint8_t {
  absent,
  frozen,       // a moving wall; the impulses on it are applied at the end of the step
  participant,  // its collisions are events like any other
};

// Constants that depend on the length of a tick.
struct TickScale {
  double tick_s = 0.0;
  double units_per_tick = 0.0;  // position units covered in a tick at 1 m/s
  double reference_speed_mps = 0.0;
  double min_separation_speed_mps = 0.0;     // normal speed after an event: no event repeats in no time
  double separation_mps_per_unit = 0.0;      // more of it per position unit of overlap; 0: never more
  std::uint32_t contact_duration_ticks = 0;  // of the TC model; 0: off
};

// Constants of a run of steps.
struct RunConstants : StepConstants {
  double ball_contact = 0.0;  // R + r, position units
  TickScale reference_ticks;  // ticks of the reference speed
};

// Constants of one step, planned before it starts.
struct StepPlan : TickScale {
  std::uint32_t start = 0;     // tick of the step's start, modulo 2^32
  std::uint32_t length = 0;    // ticks, at most kAnchorPeriod
  double max_speed_mps = 0.0;  // assumed bound on every speed in the step, of parcels and ball
  BallRole ball = BallRole::absent;
};

// Constants that the formulas of a step read.
struct ExactConstants {
  const RunConstants& run;
  StepPlan plan;
};

// Length of a tick: the reference speed, rounded up to a power of two, covers an eighth of a position unit.
PF_HD inline double tick_seconds(const World& world, double reference_mps) {
  double power = 1.0;
  while (power < reference_mps) power *= 2.0;
  while (0.5 * power >= reference_mps) power *= 0.5;
  return world.unit_m / (8.0 * power);
}

// Ticks from the step's start to the trajectory's anchor; negative if the anchor is older.
PF_HD inline std::int32_t anchor_time(const StepPlan& plan, const Trajectory& trajectory) {
  return static_cast<std::int32_t>(trajectory.tick - plan.start);
}

// Displacement in `ticks` at a constant velocity, position units.
PF_HD inline Vec2d displacement_units(const TickScale& scale, Vec2d velocity_mps, std::int64_t ticks) {
  return velocity_mps * (scale.units_per_tick * static_cast<double>(ticks));
}

// Wraps a coordinate into a periodic world.
PF_HD_RARE inline std::int64_t wrapped(std::int64_t position, std::int32_t half) {
  const std::int64_t period = 2LL * half;
  std::int64_t offset = (position + half) % period;
  if (offset < 0) offset += period;
  return offset - half;
}

// A coordinate after a displacement: wrapped in a periodic world, otherwise kept within walls or edge.
template <Boundary kBoundary>
PF_HD inline std::int32_t confined(std::int64_t position, std::int32_t half, std::int32_t radius) {
  if constexpr (kBoundary == Boundary::periodic) {
    if (position >= half || position < -static_cast<std::int64_t>(half)) position = wrapped(position, half);
  } else {
    const std::int64_t limit = kBoundary == Boundary::walls ? static_cast<std::int64_t>(half) - radius
                                                            : static_cast<std::int64_t>(half);
    if (position > limit) return static_cast<std::int32_t>(limit);
    if (position < -limit) return static_cast<std::int32_t>(-limit);
  }
  return static_cast<std::int32_t>(position);
}

PF_HD inline std::int32_t wall_radius(const StepConstants& c) { return c.contact_reach / 2; }

// Position on the trajectory at a tick of the step, rounded to position units.
template <Boundary kBoundary>
PF_HD inline Vec2i position_at(const ExactConstants& c, const Trajectory& trajectory, std::int32_t tick) {
  if (is_retired(trajectory.anchor)) return trajectory.anchor;
  const std::int64_t age = static_cast<std::int64_t>(tick) - anchor_time(c.plan, trajectory);
  const Vec2d moved = displacement_units(c.plan, to_double(trajectory.velocity), age);
  const World& world = c.run.physics.world;
  const std::int32_t radius = wall_radius(c.run);
  return {confined<kBoundary>(trajectory.anchor.x + round_to_int64(moved.x), world.half.x, radius),
          confined<kBoundary>(trajectory.anchor.y + round_to_int64(moved.y), world.half.y, radius)};
}

// The same, of a parcel that may have no finite speed: it stays at its anchor.
template <Boundary kBoundary>
PF_HD inline Vec2i place_at(const ExactConstants& c, const Trajectory& trajectory, std::int32_t tick) {
  const bool is_finite = dot(trajectory.velocity, trajectory.velocity) < kMaxFiniteSpeed2;
  return is_finite ? position_at<kBoundary>(c, trajectory, tick) : trajectory.anchor;
}

// Position that the trajectory, traced back, had at the step's start. It may lie beyond a wall.
template <Boundary kBoundary>
PF_HD inline Vec2i start_position(const ExactConstants& c, const Trajectory& trajectory) {
  if constexpr (kBoundary == Boundary::periodic) return position_at<kBoundary>(c, trajectory, 0);
  const std::int64_t age = -static_cast<std::int64_t>(anchor_time(c.plan, trajectory));
  const Vec2d moved = displacement_units(c.plan, to_double(trajectory.velocity), age);
  return {static_cast<std::int32_t>(trajectory.anchor.x + round_to_int64(moved.x)),
          static_cast<std::int32_t>(trajectory.anchor.y + round_to_int64(moved.y))};
}

// Returns whether trajectories go on when constants change during a run. Otherwise they begin anew: ticks are
// those of the reference speed, walls stand a radius away, and parcels may overlap from now on. Host only.
inline bool keeps_trajectories(const Physics& before, const Physics& after) {
  return before.parcels.radius_m == after.parcels.radius_m &&
         before.parcels.contacts == after.parcels.contacts &&
         before.reference_speed_mps == after.reference_speed_mps;
}

// Moves the anchor to a tick of the step.
template <Boundary kBoundary>
PF_HD inline void anchor_at(const ExactConstants& c, Trajectory& trajectory, std::uint32_t tick) {
  trajectory.anchor = position_at<kBoundary>(c, trajectory, static_cast<std::int32_t>(tick));
  trajectory.tick = c.plan.start + tick;
}

}  // namespace pf
