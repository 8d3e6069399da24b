// Method `exact` on the device: the first of the events that the threads of a block hold.
#pragma once

#include "cuda/exact/step_context.cuh"

namespace pf::cuda {

// The event that a thread holds, for the order of events. place: where the thread has it.
struct OrderedEvent {
  std::uint32_t tick = kNoTick, generation = kNoTick, low_id = kNoPartner, high_id = kNoPartner;
  std::uint32_t place = kInvalidIndex;
};

__device__ __forceinline__ bool comes_before(const OrderedEvent& p, const OrderedEvent& q) {
  if (p.tick != q.tick) return p.tick < q.tick;
  if (p.generation != q.generation) return p.generation < q.generation;
  if (p.low_id != q.low_id) return p.low_id < q.low_id;
  return p.high_id != q.high_id ? p.high_id < q.high_id : p.place < q.place;
}

// First of the threads' events, in all of them. space: of each warp, in the block's shared memory.
__device__ __forceinline__ OrderedEvent first_of_block(OrderedEvent best,
                                                       OrderedEvent (&space)[kExactBlock / 32]) {
  const auto of_lane = [](std::uint32_t value, unsigned offset) {
    return __shfl_xor_sync(kWholeWarp, value, offset);
  };
  for (unsigned offset = 16; offset > 0; offset /= 2) {
    const OrderedEvent other{of_lane(best.tick, offset), of_lane(best.generation, offset),
                             of_lane(best.low_id, offset), of_lane(best.high_id, offset),
                             of_lane(best.place, offset)};
    if (comes_before(other, best)) best = other;
  }
  if (threadIdx.x % 32 == 0) space[threadIdx.x / 32] = best;
  __syncthreads();
  for (const OrderedEvent& other : space) {
    if (comes_before(other, best)) best = other;
  }
  __syncthreads();
  return best;
}

}  // namespace pf::cuda
