// A parcel, and the constants that its step reads.
#pragma once

#include <cstdint>

#include "model/physics.hpp"

namespace pf {

constexpr float kMaxFiniteSpeed2 = 1e30F;  // (m/s)^2; a larger square, or NaN, counts as not finite

constexpr std::uint32_t kCrowd = 3;
constexpr float kHeating = 2.0F;

constexpr int kVelocityBits = 20;  // of a fraction of StepConstants::velocity_step_mps, in sums over contacts

struct Parcel {
  Vec2i position;
  Vec2f velocity;
  std::uint32_t id = 0;
  // 1: in its last step, of `impulse`, it touched kCrowd others or more, and these contacts raised its energy
  // to more than kHeating times; else 0. (Unused for retired parcels.)
  std::uint32_t is_heated = 0;
};

// The coordinates along an axis that the boundary leaves as they are: `num` of them from the lowest one on.
struct InsideRange {
  std::int32_t low = 0;
  std::uint32_t num = 0;

  PF_HD bool has(std::int32_t coordinate) const {
    return static_cast<std::uint32_t>(coordinate) - static_cast<std::uint32_t>(low) < num;
  }
};

// half: extent of the world along an axis. radius: of a parcel. Position units.
inline InsideRange inside_range(Boundary boundary, std::int32_t half, std::int32_t radius) {
  const std::int32_t low = boundary == Boundary::walls ? radius - half : -half;
  if (low > 0) return {low, 0};  // a world too narrow for a parcel
  const std::uint32_t both_sides = 2U * static_cast<std::uint32_t>(-low);
  return {low, boundary == Boundary::periodic ? both_sides : both_sides + 1};
}

// Constants of a step, derived once per request on the host.
struct StepConstants {
  Physics physics;
  double dt_s = 0.0;
  double advance_scale = 0.0;      // 2^32 position units per (m/s), for this dt
  double contact_distance = 0.0;   // 2 r, position units
  float filter_distance2 = 0.0F;   // slightly above its square, for the cheap first test in float
  std::int32_t contact_reach = 0;  // contact distance, rounded up
  double ball_contact_m = 0.0;     // R + r
  double velocity_unit_mps = 0.0;  // of sums over contacts
  double per_impulse_unit = 0.0;   // counts of a ball sum per m/s of parcel velocity change
  double impulse_unit_kg_mps = 0.0;
  double per_impulse_count = 0.0;  // counts of the sum over pair impulses per m/s

  // For contacts and moves of the time-stepped methods, which are computed in float.
  std::uint64_t touch_distance2 = 0;  // the smallest square at which parcels do not touch, units squared
  float touch_distance = 0.0F;        // 2 r, position units
  float per_touch_distance = 0.0F;
  float advance = 0.0F;  // position units per (m/s), for this dt: the sum of these two
  float advance_rest = 0.0F;
  InsideRange inside_x, inside_y;
  float velocity_step_mps = 0.0F;  // 2^kVelocityBits velocity units: a power of two
  float per_velocity_step = 0.0F;
  float per_impulse = 0.0F;    // per_impulse_count: a power of two
  float exchange = 0.0F;       // `impulse`: change of velocity over approach
  float spring_mps = 0.0F;     // `spring`: change of velocity in a step per position unit of overlap
  float damping_share = 0.0F;  // `spring`: change of velocity in a step over approach
};

}  // namespace pf
