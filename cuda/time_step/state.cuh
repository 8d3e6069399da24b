// What lives on the device between steps beside the parcels: the ball, the step counter, and the tallies.
#pragma once

#include <cstdint>

#include "model/ball.hpp"
#include "model/contact.hpp"
#include "model/grid.hpp"

namespace pf {

// Parcels in memory order, n entries each; by value to kernels.
struct ParcelPointers {
  Vec2i* position = nullptr;
  Vec2f* velocity = nullptr;
  std::uint32_t* id = nullptr;
  std::uint32_t* tick = nullptr;   // method exact only, else null
  std::uint32_t* last_contact_tick = nullptr;  // of the TC model, else null
};

// Keys and indices of a sort to come, n entries each; null: none is.
struct SortKeys {
  std::uint32_t* key = nullptr;
  std::uint32_t* index = nullptr;
};

// Tally of the blocks that share a slot, for one step. Integers and extremes only.
struct TallySlot {
  unsigned long long num_collisions;
  unsigned long long impulse_sum;  // two's complement counts
  unsigned long long ball_x;       // two's complement counts of the impulse unit
  unsigned long long ball_y;
  unsigned long long ball_torque;
  unsigned int num_hits;
  unsigned int num_retired;
  unsigned int num_invalid;
  unsigned int first_invalid_id;  // complemented, so that zero means none and max means smallest id
  unsigned int max_overlap_bits;  // of a non-negative float, so ordered like the number
  unsigned int max_displacement;
  unsigned int max_speed2_bits;
  unsigned long long event_hash;  // method exact
};

// Blocks add to slot blockIdx % kNumSlots: one address would serialise tens of thousands of atomics.
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
  float max_speed2;
};

struct StepState {
  BallState ball;
  BallMotion motion;            // of the coming step
  unsigned long long step = 0;  // since the reset
  std::uint32_t rounding_key = 0;
  std::int32_t last_displacement = 0;  // largest displacement along an axis in the last step, position units
  long long max_displacement = 0;  // since the sort, summed over steps
  RequestTotals totals{};
};

}  // namespace pf
