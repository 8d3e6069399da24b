// A parcel, and the constants that its step reads.
#pragma once

#include <cstdint>

#include "model/physics.hpp"

namespace pf {

constexpr float kMaxFiniteSpeed2 = 1e30F;  // (m/s)^2; a larger square, or NaN, counts as not finite

struct Parcel {
  Vec2i position;
  Vec2f velocity;
  std::uint32_t id = 0;
};

// Constants of a step, derived once per frame on the host.
struct StepConstants {
  Physics physics;
  double dt_s = 0.0;
  double advance_scale = 0.0;      // 2^32 position units per (m/s), for this dt
  double contact_distance2 = 0.0;  // (2 r)^2, position units squared
  double contact_distance = 0.0;   // 2 r, position units
  float filter_distance2 = 0.0F;   // slightly above contact_distance2, for the cheap first test in float
  std::int32_t contact_reach = 0;  // contact distance, rounded up
  double ball_contact_m = 0.0;     // R + r
  double per_velocity_unit = 0.0;  // counts of a velocity sum per m/s (a power of two)
  double velocity_unit_mps = 0.0;
  double per_impulse_unit = 0.0;  // counts of a ball sum per m/s of parcel velocity change
  double impulse_unit_kg_mps = 0.0;
  double per_impulse_count = 0.0;   // counts of the sum over pair impulses per m/s
  double spring_rate_per_s2 = 0.0;  // k / m of the spring-dashpot
  double damping_rate_per_s = 0.0;  // gamma / m
};

}  // namespace pf
