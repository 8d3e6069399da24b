// One parcel's step after its contacts are summed: new velocity, ball, boundary, new position. The CPU loop
// and the CUDA kernel both call this text.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "core/fixed_point.hpp"
#include "core/random.hpp"
#include "model/ball.hpp"
#include "model/contact.hpp"
#include "model/time_of_impact.hpp"

namespace pf {

// Modulo 2^32.
PF_HD inline std::int32_t wrapping_sum(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

// Displacement of a step along an axis, in position units. It is rounded without bias: 16 random bits per
// axis, keyed by (seed, id, step), choose between the two neighbours. Any number for 2^30 units and more. Two
// floats hold the product to 2^-46 of it, of which the fraction of a unit is then rounded to 2^-16 units.
PF_HD inline std::int32_t displacement(const StepConstants& c, float velocity_mps, std::uint32_t random16) {
  const float moved = velocity_mps * c.advance;
  const std::int32_t whole = round_to_int32(moved);
  const float lost = lost_in_product(velocity_mps, c.advance, moved) + velocity_mps * c.advance_rest;
  const float rest = (moved - static_cast<float>(whole)) + lost;
  const std::int32_t counts = round_to_int32(rest * 65536.0F);
  return wrapping_sum(whole, wrapping_sum(counts, static_cast<std::int32_t>(random16)) >> 16);
}

// In 2^-32 position units, and for a fraction of the step.
struct FineDisplacement {
  std::int64_t x = 0;
  std::int64_t y = 0;
};

PF_HD inline FineDisplacement displacement(const StepConstants& c, Vec2d velocity_mps, double fraction) {
  return {round_to_int64(velocity_mps.x * (c.advance_scale * fraction)),
          round_to_int64(velocity_mps.y * (c.advance_scale * fraction))};
}

PF_HD inline std::int64_t round_at_random(std::int64_t fixed, std::uint32_t random16) {
  return (fixed + ((static_cast<std::int64_t>(random16) << 16) + 32768)) >> 32;
}

// The 16 random bits of a parcel's step for each axis.
struct RandomBits {
  std::uint32_t x, y;
};

// Velocity and displacement of a parcel's step.
struct Movement {
  Vec2f velocity;  // m/s, after the step
  Vec2i moved;     // position units
};

// A square below the limit of finite speeds, and a displacement below 2^30 units.
PF_HD inline bool is_in_range(const StepConstants& c, Vec2f velocity_mps) {
  const Vec2f moved = velocity_mps * c.advance;
  const float x = std::fabs(moved.x), y = std::fabs(moved.y);
  return dot(velocity_mps, velocity_mps) < kMaxFiniteSpeed2 && (x > y ? x : y) < 0x1p30F;
}

// Start of a step near the ball. max_moved: bound on the displacement along an axis, position units.
struct NearBall {
  Vec2i position;
  RandomBits random;
  std::int64_t max_moved;
};

// Replaces the movement if the parcel hits the ball within the step. Returns false, and the ball is not hit,
// if the velocity would be out of range or the displacement not below its bound. In double: few parcels are
// near a ball.
template <Boundary kBoundary, EventTally Tally>
PF_HD inline bool hit_ball(const StepConstants& c, const BallMotion& ball, const NearBall& start,
                           Movement& movement, Tally& tally) {
  const World& world = c.physics.world;
  const Vec2i near = separation<kBoundary>(world, ball.centre, start.position);
  const Vec2d offset = to_double(near) * world.unit_m + (to_metres(world, ball.centre) - ball.position_m);
  const Vec2d velocity = to_double(movement.velocity);
  const Vec2d relative = velocity - ball.velocity_mps;
  const double t = time_of_impact(offset, relative, c.ball_contact_m, c.dt_s);
  if (t < 0.0) return true;
  const Vec2d at_impact = offset + relative * t;
  const double distance = sqrt(dot(at_impact, at_impact));
  const Vec2d normal = distance > 0.0 ? at_impact * (1.0 / distance) : Vec2d{1.0, 0.0};
  const BallImpulse impulse =
      ball_impulse(c.physics.ball, c.physics.parcels, normal, relative, ball.spin_radps);
  const double before = t / c.dt_s;
  const Vec2d after_hit = velocity + impulse.per_mass_mps;
  if (!is_in_range(c, to_float(after_hit))) return false;
  const FineDisplacement first = displacement(c, velocity, before);
  const FineDisplacement second = displacement(c, after_hit, 1.0 - before);
  const double overlap_units = (c.ball_contact_m - distance) / world.unit_m;
  const double push = overlap_units > 1.0 ? overlap_units * 4294967296.0 : 0.0;
  const std::int64_t x =
      round_at_random(first.x + second.x + round_to_int64(push * normal.x), start.random.x);
  const std::int64_t y =
      round_at_random(first.y + second.y + round_to_int64(push * normal.y), start.random.y);
  if (!(x < start.max_moved && x > -start.max_moved && y < start.max_moved && y > -start.max_moved))
    return false;
  movement = {to_float(after_hit), {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)}};
  tally.ball_hit(reaction_counts(impulse, c.per_impulse_unit));
  return true;
}

PF_HD inline std::uint32_t magnitude(std::int32_t value) {
  return value < 0 ? 0U - static_cast<std::uint32_t>(value) : static_cast<std::uint32_t>(value);
}

PF_HD inline bool may_reach_ball(const BallMotion& ball, std::int32_t separation, std::int32_t moved) {
  const std::uint32_t own = magnitude(moved);
  return magnitude(separation) <= static_cast<std::uint32_t>(ball.reach) + own + 2;
}

// Applies the boundary along one axis to the position after the step. Returns true if the parcel is inside.
template <Boundary kBoundary>
PF_HD inline bool apply_boundary(const InsideRange& range, std::int32_t& position, float& velocity) {
  if (range.has(position)) return true;
  const std::int64_t limit = -static_cast<std::int64_t>(range.low);
  std::int64_t inside = position;
  if constexpr (kBoundary == Boundary::open) {
    return false;
  } else if constexpr (kBoundary == Boundary::periodic) {
    while (inside >= limit) inside -= 2 * limit;  // more than once in a step through a thin world
    while (inside < -limit) inside += 2 * limit;
  } else {
    if (inside > limit) {
      inside = 2 * limit - inside;
      velocity = velocity > 0.0F ? -velocity : velocity;
      if (inside < -limit) inside = -limit;
    } else if (inside < -limit) {
      inside = -2 * limit - inside;
      velocity = velocity < 0.0F ? -velocity : velocity;
      if (inside > limit) inside = limit;
    }
  }
  position = static_cast<std::int32_t>(inside);
  return true;
}

// The change of a velocity by all contacts along an axis. NaN if one of them was out of the range of
// to_fixed(), 2^10 of the reference speed: that leaves a sum which 2^8 contacts within it cannot have. (Two
// such contacts of a parcel in one step cancel.)
PF_HD inline float velocity_change_mps(const StepConstants& c, std::int64_t sum) {
  if (!is_within_bits<30 + kVelocityBits + 8>(sum)) return std::numeric_limits<float>::quiet_NaN();
  return from_fixed<kVelocityBits>(sum) * c.velocity_step_mps;
}

// The velocity after all contacts.
PF_HD inline Vec2f velocity_after(const StepConstants& c, Vec2f velocity_mps, const ContactSums& sums) {
  return {velocity_mps.x + velocity_change_mps(c, sums.velocity_x),
          velocity_mps.y + velocity_change_mps(c, sums.velocity_y)};
}

// Push of all contacts along an axis, position units; kHalfSide stands for that much and more, in either
// direction.
PF_HD inline std::int32_t push_after(std::int64_t sum) {
  const std::int64_t units = (sum + 32768) >> kPushBits;
  return units > -kHalfSide && units < kHalfSide ? static_cast<std::int32_t>(units) : kHalfSide;
}

PF_HD inline Vec2i push_after(const ContactSums& sums) {
  return {push_after(sums.push_x), push_after(sums.push_y)};
}

// Parcel::is_heated after these contacts. m/s.
PF_HD inline std::uint32_t is_heated_by(const ContactSums& sums, Vec2f before, Vec2f after) {
  return sums.num_contacts >= kCrowd && dot(after, after) > kHeating * dot(before, before) ? 1 : 0;
}

// The effect of all contacts of a step on a parcel: its velocity after them, their push, and
// Parcel::is_heated.
struct ContactEffect {
  Vec2f velocity_mps;
  Vec2i push;
  std::uint32_t is_heated = 0;
};

PF_HD inline ContactEffect effect_of(const StepConstants& c, Vec2f velocity_mps, const ContactSums& sums) {
  const Vec2f after = velocity_after(c, velocity_mps, sums);
  return {after, push_after(sums), is_heated_by(sums, velocity_mps, after)};
}

// The effect of no contacts, bit for bit as above: a zero of either sign becomes a positive one.
PF_HD inline ContactEffect effect_of_none(Vec2f velocity_mps) { return {velocity_mps + Vec2f{}, {}, 0}; }

// Returns self after the step. kBall: true if a ball exists. step_key: see rounding_key(). A parcel whose
// displacement is NaN or beyond the world's integer range is reported and stays in place.
template <bool kBall, Boundary kBoundary, StepTally Tally>
PF_HD inline Parcel finish_step(const StepConstants& c, const BallMotion& ball, std::uint32_t step_key,
                                const Parcel& self, const ContactEffect& effect, Tally& tally) {
  const std::uint32_t bits = mix32(self.id ^ step_key);
  const RandomBits random{bits >> 16, bits & 0xFFFFU};
  const Vec2i push = effect.push;
  const std::uint32_t push_x = magnitude(push.x), push_y = magnitude(push.y);
  // Any position if the push is out of range, which is found below.
  const Vec2i start{wrapping_sum(self.position.x, push.x), wrapping_sum(self.position.y, push.y)};
  Movement movement{
      effect.velocity_mps,
      {displacement(c, effect.velocity_mps.x, random.x), displacement(c, effect.velocity_mps.y, random.y)}};
  bool is_valid = is_in_range(c, movement.velocity);
  if constexpr (kBall) {
    const Vec2i near = separation<kBoundary>(c.physics.world, ball.centre, start);
    if (is_valid && push.x != kHalfSide && push.y != kHalfSide &&
        may_reach_ball(ball, near.x, movement.moved.x) && may_reach_ball(ball, near.y, movement.moved.y)) {
      const std::int64_t max_moved = std::int64_t{kHalfSide} - (push_x > push_y ? push_x : push_y);
      is_valid = hit_ball<kBoundary>(c, ball, {start, random, max_moved}, movement, tally);
    }
  }
  const std::uint32_t displaced_x = magnitude(movement.moved.x) + push_x;
  const std::uint32_t displaced_y = magnitude(movement.moved.y) + push_y;
  const std::uint32_t displaced = displaced_x > displaced_y ? displaced_x : displaced_y;
  if (!is_valid || displaced >= static_cast<std::uint32_t>(kHalfSide)) {
    tally.invalid(self.id);
    return {self.position, self.velocity, self.id};
  }
  tally.moved(static_cast<std::int32_t>(displaced));
  Parcel after{start + movement.moved, movement.velocity, self.id, effect.is_heated};
  if (c.inside_x.has(after.position.x) && c.inside_y.has(after.position.y)) return after;
  const bool inside_x = apply_boundary<kBoundary>(c.inside_x, after.position.x, after.velocity.x);
  const bool inside_y = apply_boundary<kBoundary>(c.inside_y, after.position.y, after.velocity.y);
  if (!inside_x || !inside_y) {
    tally.retired();
    after.position = {kRetired, 0};
  }
  return after;
}

template <bool kBall, Boundary kBoundary, StepTally Tally>
PF_HD inline Parcel finish_step(const StepConstants& c, const BallMotion& ball, std::uint32_t step_key,
                                const Parcel& self, const ContactSums& sums, Tally& tally) {
  return finish_step<kBall, kBoundary>(c, ball, step_key, self, effect_of(c, self.velocity, sums), tally);
}

// Key of the random roundings of one step. step: steps since the reset.
PF_HD inline std::uint32_t rounding_key(std::uint64_t seed, std::uint64_t step) {
  return static_cast<std::uint32_t>(random_bits(seed, step, 0x726F756EULL) >> 32);
}

}  // namespace pf
