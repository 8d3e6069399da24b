// State of a run on the device beside the parcels: the ball, the step counter, and the tallies.
#pragma once

#include <cstdint>

#include "model/ball.hpp"

namespace pf {

// Tally of the blocks that share a slot, for one step: integers and extremes only, so that order does not
// matter.
struct TallySlot {
  unsigned long long num_collisions;
  unsigned long long impulse_sum;  // two's complement, impulse_counts
  unsigned long long ball_x;       // two's complement, counts of the impulse unit
  unsigned long long ball_y;
  unsigned long long ball_torque;
  unsigned int num_hits;
  unsigned int num_retired;
  unsigned int num_invalid;
  unsigned int first_invalid_id;  // complemented: zero means none, and the maximum is the smallest id
  unsigned int max_overlap_bits;  // of a non-negative float: ordered like the number
  unsigned int max_displacement;
  unsigned int max_speed2_bits;
  unsigned long long event_hash;  // method `exact`
};

// Blocks add to slot blockIdx % kNumSlots. At a single address tens of thousands of atomics would wait for
// each other.
constexpr unsigned kNumSlots = 32;

// Sums over the steps of a request.
struct RequestTotals {
  unsigned long long num_collisions;
  long long impulse_sum;
  float max_overlap;
  long long ball_x, ball_y, ball_torque;
  unsigned long long num_hits;
  unsigned long long num_retired;
  unsigned long long num_invalid;
  unsigned long long first_invalid_step;
  unsigned int first_invalid_id;
};

// Without a ball so many steps may follow one another before launch_end_steps; of steps in parts fewer, since
// each thread of find_pairs_kernel adds up their displacements.
constexpr unsigned kMaxOpenSteps = 16, kMaxOpenInParts = 4;

// Larger displacements in a step are noted as this one, position units: 16 of them fit 32 bits.
constexpr unsigned kFar = 1U << 27;
static_assert(kMaxOpenSteps <= 16);

// As of the last launch_end_steps.
struct StepState {
  BallState ball;
  BallMotion motion;            // in the next step
  BallFlight flight{};          // likewise
  unsigned long long step = 0;  // since the reset
  std::uint32_t rounding_key = 0;
  // Along an axis, of each step since, position units; kFar stands for more. Zero for those to come.
  alignas(16) unsigned int displacement[kMaxOpenSteps]{};
  std::int32_t last_displacement = 0;  // largest displacement along an axis in the last step, position units
  long long max_displacement = 0;      // bound since the sort, summed over steps
  RequestTotals totals{};
};

}  // namespace pf
