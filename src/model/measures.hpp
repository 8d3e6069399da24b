// Totals over steps, conserved quantities, and hashes of the state.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/random.hpp"
#include "model/ball.hpp"

namespace pf {

// Totals over steps. They are sums of integers and extremes, so that order and thread count do not matter.
struct StepTotals {
  std::uint64_t num_steps = 0;
  std::uint64_t num_collisions = 0;  // pair collisions
  std::uint64_t num_ball_hits = 0;
  std::uint64_t num_retired = 0;
  // Parcels whose state is not a number or out of range, in the first step that has any.
  std::uint64_t num_invalid = 0;
  std::uint64_t first_invalid_step = 0;  // 0 with `exact`, which does not divide time into steps
  std::uint32_t first_invalid_id = UINT32_MAX;
  double impulse_sum_mps = 0.0;        // sum over pair collisions of |impulse| / parcel mass
  double max_overlap_diameters = 0.0;  // largest overlap at a contact
  std::uint64_t num_sorts = 0;
  // Method `exact` only.
  std::uint64_t num_rounds = 0;
  std::uint64_t num_events = 0;         // collisions, hits, edges
  std::uint64_t num_solved_events = 0;  // in all rounds, also those of retried steps
  std::uint64_t largest_cluster = 0;    // events
  std::uint64_t num_retried_steps = 0;  // and windows, discarded and repeated, shorter or wider
  std::uint64_t event_hash = 0;         // of the list of events
  Vec2d ball_impulse_kg_mps;            // by parcels on the ball, also when it is held
  double ball_torque_impulse_kg_m2ps = 0.0;

  StepTotals& operator+=(const StepTotals& o) {
    if (num_invalid == 0 && o.num_invalid > 0) {
      num_invalid = o.num_invalid;
      first_invalid_step = o.first_invalid_step;
      first_invalid_id = o.first_invalid_id;
    }
    num_steps += o.num_steps;
    num_collisions += o.num_collisions;
    num_ball_hits += o.num_ball_hits;
    num_retired += o.num_retired;
    impulse_sum_mps += o.impulse_sum_mps;
    max_overlap_diameters = std::fmax(max_overlap_diameters, o.max_overlap_diameters);
    num_sorts += o.num_sorts;
    num_rounds += o.num_rounds;
    num_events += o.num_events;
    num_solved_events += o.num_solved_events;
    largest_cluster = largest_cluster > o.largest_cluster ? largest_cluster : o.largest_cluster;
    num_retried_steps += o.num_retried_steps;
    event_hash += o.event_hash;
    ball_impulse_kg_mps += o.ball_impulse_kg_mps;
    ball_torque_impulse_kg_m2ps += o.ball_torque_impulse_kg_m2ps;
    return *this;
  }
};

// Conserved quantities of parcels, retired ones included, plus ball.
struct Measures {
  double parcel_energy_j = 0.0;
  double ball_energy_j = 0.0;  // translation plus rotation
  Vec2d momentum_kg_mps;
  Vec2d ball_momentum_kg_mps;          // the ball's share of it
  double momentum_scale_kg_mps = 0.0;  // sum of |m v|, the scale of drifts
  std::uint64_t num_live = 0;

  double energy_j() const { return parcel_energy_j + ball_energy_j; }
  Measures& operator+=(const Measures& o) {
    parcel_energy_j += o.parcel_energy_j;
    ball_energy_j += o.ball_energy_j;
    momentum_kg_mps += o.momentum_kg_mps;
    ball_momentum_kg_mps += o.ball_momentum_kg_mps;
    momentum_scale_kg_mps += o.momentum_scale_kg_mps;
    num_live += o.num_live;
    return *this;
  }
};

// One parcel's share.
inline Measures measures_of(Vec2i position, Vec2f velocity, double mass_kg) {
  const Vec2d v = to_double(velocity);
  Measures measures;
  measures.parcel_energy_j = 0.5 * mass_kg * dot(v, v);
  measures.momentum_kg_mps = v * mass_kg;
  measures.momentum_scale_kg_mps = mass_kg * std::sqrt(dot(v, v));
  measures.num_live = is_retired(position) ? 0 : 1;
  return measures;
}

// Adds the ball's share to the sums over the parcels.
inline void add_ball(const BallConstants& ball, const BallState& state, Measures& measures) {
  if (!ball.exists) return;
  const double speed2 = dot(state.velocity_mps, state.velocity_mps);
  measures.ball_energy_j =
      0.5 * ball.mass_kg * speed2 + 0.5 * ball.inertia_kg_m2 * state.spin_radps * state.spin_radps;
  measures.ball_momentum_kg_mps = state.velocity_mps * ball.mass_kg;
  measures.momentum_kg_mps += measures.ball_momentum_kg_mps;
  measures.momentum_scale_kg_mps += ball.mass_kg * std::sqrt(speed2);
}

// c = sqrt(kT/m), the parcels' thermal speed per component, of their motion relative to their mean: in two
// dimensions that motion has the energy N m c^2. NaN without parcels.
inline double thermal_speed_mps(const ParcelConstants& parcels, const Measures& measures) {
  const double mass_kg = parcels.num * parcels.mass_kg;
  const Vec2d mean_mps = (measures.momentum_kg_mps - measures.ball_momentum_kg_mps) * (1.0 / mass_kg);
  const double c2 = measures.parcel_energy_j / mass_kg - 0.5 * dot(mean_mps, mean_mps);
  return std::sqrt(c2 < 0.0 ? 0.0 : c2);
}

// One parcel's term of the state hash. The hash of a state is the sum over parcels modulo 2^64, so that it
// depends on ids and not on the order in memory.
PF_HD inline std::uint64_t parcel_hash(std::uint32_t id, Vec2i position, Vec2f velocity) {
  const auto join = [](std::uint32_t a, std::uint32_t b) {
    return (static_cast<std::uint64_t>(a) << 32) | b;
  };
  std::uint64_t h = mix64(id);
  h = mix64(h ^ join(static_cast<std::uint32_t>(position.x), static_cast<std::uint32_t>(position.y)));
  return mix64(h ^ join(bit_copy<std::uint32_t>(velocity.x), bit_copy<std::uint32_t>(velocity.y)));
}

// Sums over parcels. hash: their terms of the state hash.
struct ParcelSums {
  Measures measures;
  std::uint64_t hash = 0;
};

PF_HD inline std::uint64_t ball_hash(const BallState& ball) {
  std::uint64_t h = 0x62616C6CULL;
  const double fields[5] = {ball.position_m.x, ball.position_m.y, ball.velocity_mps.x, ball.velocity_mps.y,
                            ball.spin_radps};
  for (double field : fields) h = mix64(h ^ bit_copy<std::uint64_t>(field));
  return h;
}

}  // namespace pf
