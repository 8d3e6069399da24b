// Method `exact`: when two bodies collide, and what a collision does to them. Host and device code.
#pragma once

#include <cstdint>

#include "model/ball.hpp"
#include "model/contact.hpp"
#include "model/exact/events.hpp"
#include "model/time_of_impact.hpp"

namespace pf {

// Conservative first test in float for two parcels on their trajectories: false only if they certainly do not
// collide before the step's end. offset: between their positions at the step's start, position units. The
// margins are a hundred times what roundings of floats can be, and what the offset lacks, kRoundingMargin at
// most. With m for that, an error of 2 m (|x| + |y|) is at most k (x^2 + y^2) + 2 m^2 / k, for any k.
PF_HD inline bool may_collide(Vec2i offset, Vec2f relative_mps, float contact, float units_in_step_per_mps) {
  constexpr float kMargin = 1e-4F, kLacking = static_cast<float>(kRoundingMargin);
  constexpr float kLackingSquares = 4.0F * kLacking * kLacking / kMargin;  // position units, squared
  const Vec2f e = {static_cast<float>(offset.x), static_cast<float>(offset.y)};
  const Vec2f w = {relative_mps.x * units_in_step_per_mps, relative_mps.y * units_in_step_per_mps};
  const float e2 = dot(e, e), w2 = dot(w, w), b = dot(e, w);
  const float slack = 2.0F * kMargin * (e2 + w2) + kLackingSquares;
  if (b > slack) return false;
  const float contact2 = (contact + 2.0F * kLacking) * (contact + 2.0F * kLacking);
  if (e2 - contact2 <= slack) return true;
  const float m = cross(e, w);
  if (m * m > contact2 * w2 * (1.0F + kMargin) + kMargin * e2 * w2) return false;
  return e2 + 2.0F * b + w2 <= contact2 + slack || -b <= w2 + slack;
}

// Relative motion of two bodies from the later of their anchors on.
struct RelativeMotion {
  Vec2d offset;    // second - first at tick `from`, position units
  Vec2d velocity;  // position units per tick
  std::int32_t from = 0;
};

// Relative motion of nearest images: nearest at the step's start, or at `from` if that is later.
template <Boundary kBoundary>
PF_HD inline RelativeMotion nearest_image_motion(const World& world, Vec2d offset, Vec2d velocity,
                                                 std::int32_t from) {
  if constexpr (kBoundary == Boundary::periodic) {
    const Vec2d to_start =
        from < 0 ? velocity * static_cast<double>(-static_cast<std::int64_t>(from)) : Vec2d{};
    const Vec2d there = offset + to_start;
    offset = {offset_of_image(offset.x, there.x, world.half.x),
              offset_of_image(offset.y, there.y, world.half.y)};
  }
  return {offset, velocity, from};
}

// Tick of the step at which two bodies are `contact` apart, position units; or kNoTick.
PF_HD inline std::uint32_t contact_tick(const StepPlan& plan, const RelativeMotion& pair, double contact) {
  const double longest = static_cast<double>(plan.length) - static_cast<double>(pair.from) + 1.0;
  const double t = time_of_impact(pair.offset, pair.velocity, contact, longest);
  return t < 0.0 ? kNoTick : event_tick(plan, pair.from, t);
}

template <Boundary kBoundary>
PF_HD inline RelativeMotion motion_from_parcel(const ExactConstants& c, const Trajectory& a,
                                               const Trajectory& b) {
  const std::int32_t time_a = anchor_time(c.plan, a);
  const std::int32_t time_b = anchor_time(c.plan, b);
  const std::int32_t from = time_a > time_b ? time_a : time_b;
  const Vec2d va = to_double(a.velocity), vb = to_double(b.velocity);
  Vec2d offset = to_double(b.anchor) - to_double(a.anchor);
  offset += displacement_units(c.plan, vb, static_cast<std::int64_t>(from) - time_b);
  offset -= displacement_units(c.plan, va, static_cast<std::int64_t>(from) - time_a);
  return nearest_image_motion<kBoundary>(c.run.physics.world, offset, (vb - va) * c.plan.units_per_tick,
                                         from);
}

// Tick at which two parcels collide, or kNoTick. Swapping them changes no bit: every term is odd in the pair.
template <Boundary kBoundary>
PF_HD inline std::uint32_t collision_tick(const ExactConstants& c, const Trajectory& a, const Trajectory& b) {
  return contact_tick(c.plan, motion_from_parcel<kBoundary>(c, a, b), c.run.contact_distance);
}

template <Boundary kBoundary>
PF_HD inline RelativeMotion motion_from_ball(const ExactConstants& c, const BallTrajectory& ball,
                                             const Trajectory& parcel) {
  const std::int32_t time = anchor_time(c.plan, parcel);
  const std::int32_t from = time > ball.tick ? time : ball.tick;
  const Vec2d v = to_double(parcel.velocity);
  Vec2d offset = to_double(parcel.anchor) - ball.anchor_units;
  offset += displacement_units(c.plan, v, static_cast<std::int64_t>(from) - time);
  offset -= displacement_units(c.plan, ball.velocity_mps, static_cast<std::int64_t>(from) - ball.tick);
  return nearest_image_motion<kBoundary>(c.run.physics.world, offset,
                                         (v - ball.velocity_mps) * c.plan.units_per_tick, from);
}

// Tick at which a parcel and the ball collide, or kNoTick.
template <Boundary kBoundary>
PF_HD inline std::uint32_t ball_collision_tick(const ExactConstants& c, const BallTrajectory& ball,
                                               const Trajectory& parcel) {
  return contact_tick(c.plan, motion_from_ball<kBoundary>(c, ball, parcel), c.run.ball_contact);
}

// Tick from which on a parcel is within `distance` of the ball, position units; 0 if it already is at the
// later anchor; kNoTick: never in the step.
template <Boundary kBoundary>
PF_HD inline std::uint32_t tick_near_ball(const ExactConstants& c, const BallTrajectory& ball,
                                          const Trajectory& parcel, double distance) {
  const RelativeMotion motion = motion_from_ball<kBoundary>(c, ball, parcel);
  if (dot(motion.offset, motion.offset) <= distance * distance) return 0;
  return contact_tick(c.plan, motion, distance);
}

// Largest distance between the ball and where it would be with another velocity, from a tick to the step's
// end, position units. bend_mps: the difference of its velocities.
PF_HD inline double bend_units(const StepPlan& plan, Vec2d bend_mps, std::uint32_t from) {
  return length(bend_mps) * plan.units_per_tick * (plan.length - from);
}

// Radius of the circle around a parcel's position at the step's start that holds the centre of every parcel
// that it may touch in the step. closing_speed_mps: bound on the sum of both speeds. Position units.
template <class Real>
PF_HD inline Real search_radius(const ExactConstants& c, Real closing_speed_mps) {
  constexpr Real kAboveRoundings = Real{1} + Real{1e-5};
  const auto per_mps = static_cast<Real>(c.plan.units_per_tick * c.plan.length);
  return (static_cast<Real>(c.run.contact_distance) + closing_speed_mps * per_mps) * kAboveRoundings +
         static_cast<Real>(kRoundingMargin);
}

// Returns whether an event at `tick` follows a parcel's last contact so soon that it loses no energy (the TC
// model, Luding and McNamara 1998). Ticks of contacts count modulo 2^32, as those of anchors.
PF_HD inline bool is_in_contact(const StepPlan& plan, std::uint32_t tick, std::uint32_t last_contact_tick) {
  return plan.contact_duration_ticks != 0 &&
         plan.start + tick - last_contact_tick <= plan.contact_duration_ticks;
}

// Least normal speed at which two bodies part after an event. overlap: of their stored positions, position
// units. What roundings may have added up to is undone in a set number of ticks. More than that was there
// from the start: then it stays.
PF_HD inline double min_separation_speed_mps(const TickScale& scale, double overlap) {
  constexpr double kRounding = 0.5, kLargest = 8.0;
  const double min_mps = scale.min_separation_speed_mps;
  if (!(overlap > kRounding && overlap <= kLargest)) return min_mps;
  return min_mps + (overlap - kRounding) * scale.separation_mps_per_unit;
}

// Collides two parcels that are anchored at the tick of their event. They exchange momentum along the line e
// of their stored centres: k = (1 + e_n) b / (2 |e|^2), v1 += k e, v2 -= k e. The normal is not normalised,
// and all is double until the velocities are stored. elastic: no loss in this event (the TC model, Luding and
// McNamara 1998).
template <Boundary kBoundary, EventTally Tally>
PF_HD inline void collide(const ExactConstants& c, Trajectory& first, Trajectory& second, bool elastic,
                          Tally& tally) {
  Vec2d e = nearest_image<kBoundary>(c.run.physics.world, to_double(second.anchor) - to_double(first.anchor));
  if (e.x == 0.0 && e.y == 0.0) e = {1.0, 0.0};
  const Vec2d v1 = to_double(first.velocity), v2 = to_double(second.velocity);
  const double e2 = dot(e, e);
  const double distance = sqrt(e2);
  const double b = dot(e, v2 - v1);
  const double restitution = elastic ? 1.0 : c.run.physics.parcels.restitution;
  const double overlap = c.run.contact_distance - distance;
  const double min_separation = min_separation_speed_mps(c.plan, overlap) * distance;
  const double separation_b = -restitution * b > min_separation ? -restitution * b : min_separation;
  const double k = (b - separation_b) / (2.0 * e2);
  first.velocity = to_float(v1 + e * k);
  second.velocity = to_float(v2 - e * k);
  tally.begin_contact();
  tally.impulse(impulse_counts(-k * distance, c.run.per_impulse_count));
  tally.overlap(static_cast<float>(overlap / c.run.contact_distance));
}

// Change of the ball by a collision, per parcel mass.
struct BallReaction {
  Vec2d velocity_mps;  // times parcel mass / ball mass
  double spin_mps;     // times parcel mass * radius / inertia
};

// Collides a parcel that is anchored at the tick of its event with the ball; returns the ball's reaction.
template <Boundary kBoundary, EventTally Tally>
PF_HD inline BallReaction collide_with_ball(const ExactConstants& c, const BallTrajectory& ball,
                                            std::uint32_t tick, Trajectory& parcel, Tally& tally) {
  const Physics& physics = c.run.physics;
  const std::int64_t ball_age = static_cast<std::int64_t>(tick) - ball.tick;
  const Vec2d centre = ball.anchor_units + displacement_units(c.plan, ball.velocity_mps, ball_age);
  const Vec2d offset = nearest_image<kBoundary>(physics.world, to_double(parcel.anchor) - centre);
  const double distance = length(offset);
  const Vec2d normal = distance > 0.0 ? offset * (1.0 / distance) : Vec2d{1.0, 0.0};
  const Vec2d relative = to_double(parcel.velocity) - ball.velocity_mps;
  BallImpulse impulse = ball_impulse(physics.ball, physics.parcels, normal, relative, ball.spin_radps);
  // Change of the relative velocity per change of the parcel's: a participant recoils.
  const double recoil =
      c.plan.ball == BallRole::participant ? 1.0 + physics.parcels.mass_kg / physics.ball.mass_kg : 1.0;
  const double separation_mps = dot(relative + impulse.per_mass_mps * recoil, normal);
  const double min_speed_mps = min_separation_speed_mps(c.plan, c.run.ball_contact - distance);
  if (separation_mps < min_speed_mps)
    impulse.per_mass_mps += normal * ((min_speed_mps - separation_mps) / recoil);
  parcel.velocity = to_float(to_double(parcel.velocity) + impulse.per_mass_mps);
  tally.ball_hit(reaction_counts(impulse, c.run.per_impulse_unit));
  return {-impulse.per_mass_mps, -impulse.tangential_mps};
}

}  // namespace pf
