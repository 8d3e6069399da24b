// The ball: its flight between hits, its contact with a parcel, and the sums of impulses on it.
#pragma once

#include <cstdint>

#include "model/physics.hpp"

namespace pf {

// The ball as the parcels of one step see it: a disc that moves along the chord of its arc.
struct BallMotion {
  Vec2d position_m;    // centre at the start of the step
  Vec2d velocity_mps;  // chord / dt
  double spin_radps = 0.0;
  Vec2i centre;            // centre at the start of the step, position units (saturated)
  std::int32_t reach = 0;  // contact distance plus chord, position units (saturated): the cheap first test
};

// Impulse and torque on the ball in fixed point, so that the sums do not depend on the order of the hits.
// Units: parcel mass * velocity unit. The torque is per ball radius.
struct BallSums {
  std::int64_t impulse_x = 0;
  std::int64_t impulse_y = 0;
  std::int64_t torque = 0;

  PF_HD BallSums& operator+=(const BallSums& o) {
    impulse_x += o.impulse_x;
    impulse_y += o.impulse_y;
    torque += o.torque;
    return *this;
  }
};

struct BallFlight {
  Vec2d displacement_m;
  Vec2d velocity_mps;  // at the end
  double dt_s = 0.0;
};

// Flight of the ball alone over dt_s. The velocity turns at magnus * spin and slows by drag |v| v. Turn and
// slowing commute, so that direction and speed are exact: 1/v = 1/v0 + drag t. Without drag the displacement
// is the exact chord of the arc. With drag it is a five-point Gauss-Legendre quadrature of the velocity.
PF_HD inline BallFlight fly(const BallConstants& ball, const BallState& state, double dt_s) {
  if (ball.held) return {{0.0, 0.0}, {0.0, 0.0}, dt_s};
  const double turn_rate = ball.magnus_per_rad * state.spin_radps;
  const Vec2d v = state.velocity_mps;
  if (turn_rate == 0.0 && ball.drag_per_m == 0.0) return {v * dt_s, v, dt_s};
  const auto turned = [&](const SinCos& turn) {
    return Vec2d{v.x * turn.cos - v.y * turn.sin, v.x * turn.sin + v.y * turn.cos};
  };
  if (ball.drag_per_m == 0.0) {
    const double theta = turn_rate * dt_s;
    const SinCos turn = sin_cos(theta);
    const bool small = theta < 1e-4 && theta > -1e-4;
    const double along = small ? dt_s * (1.0 - theta * theta / 6.0) : turn.sin / turn_rate;
    const double across = small ? dt_s * theta * (0.5 - theta * theta / 24.0) : (1.0 - turn.cos) / turn_rate;
    return {v * along + perpendicular(v) * across, turned(turn), dt_s};
  }
  const double speed = sqrt(dot(v, v));
  const auto velocity_at = [&](double t) {
    return turned(sin_cos(turn_rate * t)) * (1.0 / (1.0 + ball.drag_per_m * speed * t));
  };
  constexpr double kNode[2] = {0.53846931010568309104, 0.90617984593866399280};
  constexpr double kWeight[3] = {128.0 / 225.0, 0.47862867049936646804, 0.23692688505618908751};
  Vec2d mean = velocity_at(0.5 * dt_s) * kWeight[0];
  for (int k = 0; k < 2; ++k) {
    const double offset = 0.5 * kNode[k];
    mean += (velocity_at((0.5 - offset) * dt_s) + velocity_at((0.5 + offset) * dt_s)) * kWeight[k + 1];
  }
  return {mean * (0.5 * dt_s), velocity_at(dt_s), dt_s};
}

PF_HD inline std::int32_t saturated_units(double units) {
  constexpr double kLimit = 2147483000.0;
  const double clamped = units > kLimit ? kLimit : (units < -kLimit ? -kLimit : units);
  return static_cast<std::int32_t>(round_to_int64(clamped));
}

// Motion of the ball in a step whose flight fly() found. contact_distance_m: ball radius + parcel radius.
PF_HD inline BallMotion ball_motion(const World& world, const BallConstants& ball, const BallState& state,
                                    const BallFlight& flight, double contact_distance_m) {
  BallMotion motion;
  motion.position_m = state.position_m;
  motion.velocity_mps = ball.held ? Vec2d{} : flight.displacement_m * (1.0 / flight.dt_s);
  motion.spin_radps = state.spin_radps;
  motion.centre = {saturated_units(state.position_m.x / world.unit_m),
                   saturated_units(state.position_m.y / world.unit_m)};
  const double chord_m = sqrt(dot(flight.displacement_m, flight.displacement_m));
  motion.reach = saturated_units((contact_distance_m + chord_m) / world.unit_m + 4.0);
  return motion;
}

// A ball that moves farther than the world is wide comes back as often as it has left. One without room
// between walls stays in the middle.
PF_HD inline void apply_boundary_to_ball(const World& world, double radius_m, BallState& state) {
  const auto reflect = [](double& x, double& v, double limit) {
    if (limit <= 0.0) {
      x = 0.0;
      return;
    }
    const double times = floor((x + limit) / (2.0 * limit));  // that it crosses the world, with a sign
    const bool is_odd = fmod(times, 2.0) != 0.0;
    const bool moves_up = (x > limit) != is_odd;
    x -= 2.0 * limit * times;
    if (is_odd) x = -x;
    v = moves_up ? fabs(v) : -fabs(v);
  };
  const auto one_axis = [&](double& x, double& v, std::int32_t half) {
    const double half_m = half * world.unit_m;
    if (world.boundary == Boundary::walls) {
      const double limit = half_m - radius_m;
      if (x > limit || x < -limit) reflect(x, v, limit);
    } else if (world.boundary == Boundary::periodic) {
      if (x >= half_m || x < -half_m) x -= 2.0 * half_m * floor((x + half_m) / (2.0 * half_m));
    }
  };
  one_axis(state.position_m.x, state.velocity_mps.x, world.half.x);
  one_axis(state.position_m.y, state.velocity_mps.y, world.half.y);
}

// Changes the ball's velocity and spin by the impulses of hits. impulse_unit_kg_mps: value of one count of
// hits.impulse.
PF_HD inline void apply_hits(const BallConstants& ball, const BallSums& hits, double impulse_unit_kg_mps,
                             BallState& state) {
  const double per_mass = impulse_unit_kg_mps / ball.mass_kg;
  state.velocity_mps +=
      Vec2d{static_cast<double>(hits.impulse_x) * per_mass, static_cast<double>(hits.impulse_y) * per_mass};
  state.spin_radps +=
      static_cast<double>(hits.torque) * (impulse_unit_kg_mps * ball.radius_m / ball.inertia_kg_m2);
}

// Advances the ball over a step's flight, which fly() found, then applies the impulses of the step's hits.
PF_HD inline void advance_ball(const World& world, const BallConstants& ball, const BallFlight& flight,
                               const BallSums& hits, double impulse_unit_kg_mps, BallState& state) {
  if (ball.held) return;
  state.position_m += flight.displacement_m;
  state.angle_rad += state.spin_radps * flight.dt_s;
  state.velocity_mps = flight.velocity_mps;
  apply_hits(ball, hits, impulse_unit_kg_mps, state);
  apply_boundary_to_ball(world, ball.radius_m, state);
}

// Drag coefficient, referred to rho V^2 R_c with R_c = R + r, of a disc that does not spin in a cold stream
// of light parcels: the limit S -> infinity of free-molecular flow with restitution and Coulomb friction.
PF_HD inline double cold_drag_coefficient(double restitution, double friction) {
  const double kappa = friction * (1.0 + restitution);
  return 4.0 / 3.0 * (1.0 + restitution) + 2.0 / 3.0 * kappa / sqrt(1.0 + kappa * kappa);
}

// Impulse on a parcel that touches the ball, per parcel mass. Its tangential part is positive along
// perpendicular(normal), with normal the unit vector from ball to parcel. Coulomb friction stops the slip
// unless that takes more than friction times the normal impulse.
struct BallImpulse {
  Vec2d per_mass_mps;
  double tangential_mps;
};

PF_HD inline BallImpulse ball_impulse(const BallConstants& ball, const ParcelConstants& parcels, Vec2d normal,
                                      Vec2d relative_velocity, double spin_radps) {
  const double mass_ratio = parcels.mass_kg / ball.mass_kg;
  const double normal_speed = dot(relative_velocity, normal);
  const double share = ball.held ? 1.0 : 1.0 / (1.0 + mass_ratio);
  const double normal_mps = -(1.0 + parcels.restitution) * normal_speed * share;
  double tangential_mps = 0.0;
  if (ball.friction > 0.0) {
    const double slip = dot(relative_velocity, perpendicular(normal)) - spin_radps * ball.radius_m;
    const double lever = parcels.mass_kg * ball.radius_m * ball.radius_m / ball.inertia_kg_m2;
    const double stick = ball.held ? -slip : -slip / (1.0 + mass_ratio + lever);
    const double bound = ball.friction * normal_mps;
    tangential_mps = stick > bound ? bound : (stick < -bound ? -bound : stick);
  }
  return {normal * normal_mps + perpendicular(normal) * tangential_mps, tangential_mps};
}

// Reaction of the ball to an impulse on a parcel. per_impulse_unit: counts per m/s.
PF_HD inline BallSums reaction_counts(const BallImpulse& impulse, double per_impulse_unit) {
  return {round_to_int64(-impulse.per_mass_mps.x * per_impulse_unit),
          round_to_int64(-impulse.per_mass_mps.y * per_impulse_unit),
          round_to_int64(-impulse.tangential_mps * per_impulse_unit)};
}

}  // namespace pf
