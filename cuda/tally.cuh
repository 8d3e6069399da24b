// Tallies of kernels, added up from threads to warps, blocks, and the slots in global memory. They are
// integers and extremes only, so that order does not matter.
#pragma once

#include "cuda/architecture.cuh"
#include "cuda/time_step/state.cuh"
#include "model/tally.hpp"

namespace pf {

// Frequent values stay in the thread's registers until the warp is reduced; rare events go to the block's
// slot in shared memory at once.
struct DeviceTally {
  TallySlot* block;
  unsigned int num_collisions = 0;
  long long impulse_sum = 0;
  float max_overlap = 0.0F;
  unsigned int displacement = 0;

  __device__ inline void overlap(float diameters) { max_overlap = fmaxf(max_overlap, diameters); }
  __device__ inline void begin_contact() { ++num_collisions; }
  __device__ inline void impulse(std::int32_t counts) { impulse_sum += counts; }
  __device__ inline void ball_hit(const BallSums& hit) {
    atomicAdd(&block->num_hits, 1U);
    atomicAdd(&block->ball_x, static_cast<unsigned long long>(hit.impulse_x));
    atomicAdd(&block->ball_y, static_cast<unsigned long long>(hit.impulse_y));
    atomicAdd(&block->ball_torque, static_cast<unsigned long long>(hit.torque));
  }
  __device__ inline void moved(std::int32_t by_units) {
    displacement = max(displacement, static_cast<unsigned int>(by_units));
  }
  __device__ inline void retired() { atomicAdd(&block->num_retired, 1U); }
  __device__ inline void invalid(std::uint32_t id) {
    atomicAdd(&block->num_invalid, 1U);
    atomicMax(&block->first_invalid_id, ~id);
  }
};
static_assert(StepTally<DeviceTally>);

// Adds the warp's tallies to the block's. All 32 threads must call it.
__device__ inline void reduce_warp(const DeviceTally& tally, TallySlot& block) {
  const bool leads = threadIdx.x % 32 == 0;
  const unsigned int displacement = warp_max(tally.displacement);
  if (leads) atomicMax(&block.max_displacement, displacement);
  if (!__any_sync(0xFFFFFFFFU, tally.max_overlap > 0.0F)) return;  // nothing touched
  const unsigned int collisions = warp_add(tally.num_collisions);
  // In two parts: a thread's sum is below 2^50, or 2^25 contacts of 2^25 counts each.
  constexpr int kLowBits = 24;
  const auto low = static_cast<std::uint32_t>(tally.impulse_sum) & ((1U << kLowBits) - 1U);
  const auto high = static_cast<std::uint32_t>(tally.impulse_sum >> kLowBits);
  const long long impulse =
      static_cast<long long>(static_cast<std::int32_t>(warp_add(high))) * (1LL << kLowBits) + warp_add(low);
  const unsigned int overlap = warp_max(__float_as_uint(tally.max_overlap));
  if (leads) {
    atomicAdd(&block.num_collisions, static_cast<unsigned long long>(collisions));
    atomicAdd(&block.impulse_sum, static_cast<unsigned long long>(impulse));
    atomicMax(&block.max_overlap_bits, overlap);
  }
}

__device__ inline void add_slot(TallySlot& to, const TallySlot& from) {
  if (from.num_collisions != 0) atomicAdd(&to.num_collisions, from.num_collisions);
  if (from.impulse_sum != 0) atomicAdd(&to.impulse_sum, from.impulse_sum);
  if (from.max_overlap_bits != 0) atomicMax(&to.max_overlap_bits, from.max_overlap_bits);
  if (from.num_hits != 0) {
    atomicAdd(&to.num_hits, from.num_hits);
    atomicAdd(&to.ball_x, from.ball_x);
    atomicAdd(&to.ball_y, from.ball_y);
    atomicAdd(&to.ball_torque, from.ball_torque);
  }
  if (from.event_hash != 0) atomicAdd(&to.event_hash, from.event_hash);
  if (from.num_retired != 0) atomicAdd(&to.num_retired, from.num_retired);
  if (from.num_invalid != 0) {
    atomicAdd(&to.num_invalid, from.num_invalid);
    atomicMax(&to.first_invalid_id, from.first_invalid_id);
  }
  atomicMax(&to.max_displacement, from.max_displacement);
  if (from.max_speed2_bits != 0) atomicMax(&to.max_speed2_bits, from.max_speed2_bits);
}

__device__ inline unsigned long long sum_over_warp(unsigned long long value) {
  for (int lane = 16; lane > 0; lane /= 2) value += __shfl_xor_sync(0xFFFFFFFFU, value, lane);
  return value;
}

// Sum of the 32 threads' slots, in all of them.
__device__ inline TallySlot sum_slots(const TallySlot& slot) {
  static_assert(kNumSlots == 32, "one warp reduces the slots");
  TallySlot sum;
  sum.num_collisions = sum_over_warp(slot.num_collisions);
  sum.impulse_sum = sum_over_warp(slot.impulse_sum);
  sum.ball_x = sum_over_warp(slot.ball_x);
  sum.ball_y = sum_over_warp(slot.ball_y);
  sum.ball_torque = sum_over_warp(slot.ball_torque);
  sum.event_hash = sum_over_warp(slot.event_hash);
  sum.num_hits = warp_add(slot.num_hits);
  sum.num_retired = warp_add(slot.num_retired);
  sum.num_invalid = warp_add(slot.num_invalid);
  sum.first_invalid_id = warp_max(slot.first_invalid_id);
  sum.max_overlap_bits = warp_max(slot.max_overlap_bits);
  sum.max_displacement = warp_max(slot.max_displacement);
  sum.max_speed2_bits = warp_max(slot.max_speed2_bits);
  return sum;
}

__device__ inline void add_to_totals(const TallySlot& sum, unsigned long long step, RequestTotals& totals) {
  totals.num_collisions += sum.num_collisions;
  totals.impulse_sum += static_cast<long long>(sum.impulse_sum);
  totals.max_overlap = fmaxf(totals.max_overlap, __uint_as_float(sum.max_overlap_bits));
  totals.ball_x += static_cast<long long>(sum.ball_x);
  totals.ball_y += static_cast<long long>(sum.ball_y);
  totals.ball_torque += static_cast<long long>(sum.ball_torque);
  totals.num_hits += sum.num_hits;
  totals.num_retired += sum.num_retired;
  if (totals.num_invalid == 0 && sum.num_invalid != 0) {
    totals.num_invalid = sum.num_invalid;
    totals.first_invalid_step = step;
    totals.first_invalid_id = ~sum.first_invalid_id;
  }
}

}  // namespace pf
