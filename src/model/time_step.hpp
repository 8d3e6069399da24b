// One parcel's step after its contacts are summed: new velocity, ball, boundary, new position. The CPU loop
// and the CUDA kernel both call this text.
#pragma once

#include <cstdint>

#include "core/random.hpp"
#include "model/ball.hpp"
#include "model/contact.hpp"
#include "model/time_of_impact.hpp"

namespace pf {

// Displacement in 2^-32 position units. It is rounded without bias: 16 random bits per axis, keyed by (seed,
// id, step), choose between the two neighbours.
struct Displacement {
  std::int64_t x = 0;
  std::int64_t y = 0;
};

PF_HD inline Displacement displacement(const StepConstants& c, Vec2d velocity_mps, double fraction) {
  return {round_to_int64(velocity_mps.x * (c.advance_scale * fraction)),
          round_to_int64(velocity_mps.y * (c.advance_scale * fraction))};
}

PF_HD inline std::int64_t round_at_random(std::int64_t fixed, std::uint32_t random16) {
  return (fixed + ((static_cast<std::int64_t>(random16) << 16) + 32768)) >> 32;
}

// Replaces velocity and displacement if the parcel hits the ball within the step.
template <Boundary kBoundary, EventTally Tally>
PF_HD inline void hit_ball(const StepConstants& c, const BallMotion& ball, Vec2i position, Vec2d& velocity,
                           Displacement& moved, Tally& tally) {
  const World& world = c.physics.world;
  const Vec2i near = separation<kBoundary>(world, ball.centre, position);
  const Vec2d offset = to_double(near) * world.unit_m + (to_metres(world, ball.centre) - ball.position_m);
  const Vec2d relative = velocity - ball.velocity_mps;
  const double t = time_of_impact(offset, relative, c.ball_contact_m, c.dt_s);
  if (t < 0.0) return;
  const Vec2d at_impact = offset + relative * t;
  const double distance = sqrt(dot(at_impact, at_impact));
  const Vec2d normal = distance > 0.0 ? at_impact * (1.0 / distance) : Vec2d{1.0, 0.0};
  const BallImpulse impulse =
      ball_impulse(c.physics.ball, c.physics.parcels, normal, relative, ball.spin_radps);
  const double before = t / c.dt_s;
  const Displacement first = displacement(c, velocity, before);
  velocity += impulse.per_mass_mps;
  const Displacement second = displacement(c, velocity, 1.0 - before);
  const double overlap_units = (c.ball_contact_m - distance) / world.unit_m;
  const double push = overlap_units > 1.0 ? overlap_units * 4294967296.0 : 0.0;
  moved = {first.x + second.x + round_to_int64(push * normal.x),
           first.y + second.y + round_to_int64(push * normal.y)};
  tally.ball_hit({round_to_int64(-impulse.per_mass_mps.x * c.per_impulse_unit),
                  round_to_int64(-impulse.per_mass_mps.y * c.per_impulse_unit),
                  round_to_int64(-impulse.tangential_mps * c.per_impulse_unit)});
}

PF_HD inline bool may_reach_ball(const BallMotion& ball, std::int32_t separation, std::int64_t moved) {
  const std::int64_t distance = separation < 0 ? -static_cast<std::int64_t>(separation) : separation;
  const std::int64_t whole = moved >> 32;  // shifted first: NaN rounds to the smallest integer
  const std::int64_t own = whole < 0 ? -whole : whole;
  return distance <= static_cast<std::int64_t>(ball.reach) + own + 2;
}

// Applies the boundary along one axis to the position after the step. Returns true if the parcel is inside.
template <Boundary kBoundary>
PF_HD inline bool apply_boundary(std::int64_t& position, float& velocity, std::int32_t half,
                                 std::int32_t radius) {
  if constexpr (kBoundary == Boundary::open) {
    return position >= -static_cast<std::int64_t>(half) && position <= half;
  } else if constexpr (kBoundary == Boundary::periodic) {
    const std::int64_t period = 2LL * half;
    while (position >= half) position -= period;  // more than once in a step through a thin world
    while (position < -static_cast<std::int64_t>(half)) position += period;
    return true;
  } else {
    const std::int64_t limit = static_cast<std::int64_t>(half) - radius;
    if (position > limit) {
      position = 2 * limit - position;
      velocity = velocity > 0.0F ? -velocity : velocity;
      if (position < -limit) position = -limit;
    } else if (position < -limit) {
      position = -2 * limit - position;
      velocity = velocity < 0.0F ? -velocity : velocity;
      if (position > limit) position = limit;
    }
    return true;
  }
}

// Returns self after the step. kBall: true if a ball exists. step_key: see rounding_key(). A parcel whose
// displacement is NaN or beyond the world's integer range is reported and stays in place.
template <bool kBall, Boundary kBoundary, StepTally Tally>
PF_HD inline Parcel finish_step(const StepConstants& c, const BallMotion& ball, std::uint32_t step_key,
                                const Parcel& self, const ContactSums& sums, Tally& tally) {
  const World& world = c.physics.world;
  Vec2d velocity = to_double(self.velocity);
  velocity.x += static_cast<double>(sums.velocity_x) * c.velocity_unit_mps;
  velocity.y += static_cast<double>(sums.velocity_y) * c.velocity_unit_mps;
  const Vec2i push = {static_cast<std::int32_t>((sums.push_x + 32768) >> 16),
                      static_cast<std::int32_t>((sums.push_y + 32768) >> 16)};
  const Vec2i start = self.position + push;
  Displacement moved = displacement(c, velocity, 1.0);
  if constexpr (kBall) {
    const Vec2i near = separation<kBoundary>(world, ball.centre, start);
    if (may_reach_ball(ball, near.x, moved.x) && may_reach_ball(ball, near.y, moved.y)) {
      hit_ball<kBoundary>(c, ball, start, velocity, moved, tally);
    }
  }
  const std::uint32_t random = mix32(self.id ^ step_key);
  const std::int64_t move_x = round_at_random(moved.x, random >> 16);
  const std::int64_t move_y = round_at_random(moved.y, random & 0xFFFFU);
  const std::int64_t displaced_x = (move_x < 0 ? -move_x : move_x) + (push.x < 0 ? -push.x : push.x);
  const std::int64_t displaced_y = (move_y < 0 ? -move_y : move_y) + (push.y < 0 ? -push.y : push.y);
  const std::int64_t displaced = displaced_x > displaced_y ? displaced_x : displaced_y;
  Vec2f new_velocity = to_float(velocity);
  const float speed2 = new_velocity.x * new_velocity.x + new_velocity.y * new_velocity.y;
  if (!(speed2 < kMaxFiniteSpeed2) || displaced >= kHalfSide) {
    tally.invalid(self.id);
    return self;
  }
  tally.moved(static_cast<std::int32_t>(displaced), speed2);
  std::int64_t x = start.x + move_x;
  std::int64_t y = start.y + move_y;
  const std::int32_t radius = c.contact_reach / 2;
  const bool inside_x = apply_boundary<kBoundary>(x, new_velocity.x, world.half.x, radius);
  const bool inside_y = apply_boundary<kBoundary>(y, new_velocity.y, world.half.y, radius);
  if (!inside_x || !inside_y) {
    tally.retired();
    return {{kRetired, 0}, new_velocity, self.id};
  }
  return {{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)}, new_velocity, self.id};
}

// Key of the random roundings of one step. step: steps since the reset.
PF_HD inline std::uint32_t rounding_key(std::uint64_t seed, std::uint64_t step) {
  return static_cast<std::uint32_t>(random_bits(seed, step, 0x726F756EULL) >> 32);
}

}  // namespace pf
