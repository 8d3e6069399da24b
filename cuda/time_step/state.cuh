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
  unsigned int max_speed2_bits;   // method `exact`
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

// Largest number of open steps before launch_end_steps. They are open until then.
constexpr unsigned kMaxOpenSteps = 16;

// As of the last launch_end_steps, except what is of open steps. The ball is where the last of these begins.
// Displacements are along an axis, in position units; kHalfSide stands for that far and farther.
struct StepState {
  BallState ball;
  BallFlight flight{};                              // in that step, or in the next one if none is open
  BallMotion motion;                                // likewise
  unsigned long long step = 0;                      // since the reset
  std::uint32_t rounding_key[kMaxOpenSteps]{};      // of the next steps
  std::uint32_t displacement[kMaxOpenSteps]{};      // largest in each open step; zero in those to come
  std::uint32_t displaced_before[kMaxOpenSteps]{};  // bound since the sort, where an open step begins
  std::uint32_t displaced = 0;                      // bound since the sort
  std::uint32_t none = 0;                           // a zero to point at
  std::int32_t last_displacement = 0;               // largest in the last step
  RequestTotals totals{};
};

// Two words whose sum bounds the displacements since the sort, which may have come after the last step, or in
// it, or before.
struct DisplacedSinceSort {
  const std::uint32_t* before_last = nullptr;  // before the last step
  const std::uint32_t* in_last = nullptr;
};

}  // namespace pf
