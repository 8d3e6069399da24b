// Tally of one thread in one step. All sums are integers and all extremes exact, so that the totals do not
// depend on how parcels are shared among threads.
#pragma once

#include <algorithm>
#include <cstdint>

#include "model/ball.hpp"
#include "model/contact.hpp"
#include "model/measures.hpp"

namespace pf {

struct alignas(64) CpuTally {
  std::uint64_t num_collisions = 0;
  std::uint64_t num_ball_hits = 0;
  std::uint64_t num_retired = 0;
  std::uint64_t num_invalid = 0;
  std::uint32_t first_invalid_id = UINT32_MAX;
  std::int64_t impulse_sum = 0;       // of impulse_counts
  float max_overlap = 0.0F;           // diameters
  float max_speed2 = 0.0F;            // (m/s)^2, in method `exact`
  std::int32_t max_displacement = 0;  // position units, along an axis
  BallSums ball;

  void overlap(float diameters) { max_overlap = std::max(max_overlap, diameters); }
  void impulse(std::int32_t counts) { impulse_sum += counts; }
  void begin_contact() { ++num_collisions; }
  void ball_hit(const BallSums& hit) {
    ++num_ball_hits;
    ball += hit;
  }
  void moved(std::int32_t displacement) { max_displacement = std::max(max_displacement, displacement); }
  void fly(float speed2) { max_speed2 = std::max(max_speed2, speed2); }
  void retired() { ++num_retired; }
  void invalid(std::uint32_t id) {
    ++num_invalid;
    first_invalid_id = std::min(first_invalid_id, id);
  }

  void add(const CpuTally& o) {
    num_collisions += o.num_collisions;
    num_retired += o.num_retired;
    num_invalid += o.num_invalid;
    first_invalid_id = std::min(first_invalid_id, o.first_invalid_id);
    impulse_sum += o.impulse_sum;
    overlap(o.max_overlap);
    moved(o.max_displacement);
    fly(o.max_speed2);
    num_ball_hits += o.num_ball_hits;
    ball += o.ball;
  }
};

// The tally in physical units. c: constants of the step.
inline StepTotals totals_of(const StepConstants& c, const CpuTally& sum) {
  StepTotals totals;
  totals.num_collisions = sum.num_collisions;
  totals.num_ball_hits = sum.num_ball_hits;
  totals.num_retired = sum.num_retired;
  totals.num_invalid = sum.num_invalid;
  totals.first_invalid_id = sum.first_invalid_id;
  totals.impulse_sum_mps = static_cast<double>(sum.impulse_sum) / c.per_impulse_count;
  totals.max_overlap_diameters = static_cast<double>(sum.max_overlap);
  totals.ball_impulse_kg_mps =
      Vec2d{static_cast<double>(sum.ball.impulse_x), static_cast<double>(sum.ball.impulse_y)} *
      c.impulse_unit_kg_mps;
  totals.ball_torque_impulse_kg_m2ps =
      static_cast<double>(sum.ball.torque) * c.impulse_unit_kg_mps * c.physics.ball.radius_m;
  return totals;
}

}  // namespace pf
