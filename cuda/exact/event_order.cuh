// Method `exact` on the device: the first of the events that the threads of a block hold.
#pragma once

#include "cuda/exact/step_context.cuh"

namespace pf::cuda {

// The event that a thread holds, for the order of events. place: where the thread has it.
struct OrderedEvent : EventOrder {
  std::uint32_t place = kInvalidIndex;
};

__device__ __forceinline__ bool comes_before(const OrderedEvent& p, const OrderedEvent& q) {
  const EventOrder &first = p, &second = q;
  if (pf::comes_before(first, second)) return true;
  return !pf::comes_before(second, first) && p.place < q.place;
}

// The lane of a warp whose event comes first, or 32. Mostly one has it, or the two partners of one event.
__device__ __forceinline__ unsigned first_lane(const OrderedEvent& event) {
  const std::uint32_t tick = warp_min(event.tick);
  if (tick == kNoTick) return 32;
  bool among = event.tick == tick;
  const auto of = [](std::uint32_t value, unsigned lane) { return __shfl_sync(kWholeWarp, value, lane); };
  const auto first_among = [&] { return __ffs(__ballot_sync(kWholeWarp, among)) - 1; };
  // All lanes take part in each exchange, so none of them stands behind a condition.
  const unsigned first = first_among();
  const std::uint32_t first_generation = of(event.generation, first);
  const std::uint32_t first_low = of(event.low_id, first), first_high = of(event.high_id, first);
  const bool differs =
      event.generation != first_generation || event.low_id != first_low || event.high_id != first_high;
  if (!__any_sync(kWholeWarp, among && differs)) return first;
  const auto keep_lowest = [&](std::uint32_t value) {
    const std::uint32_t lowest = warp_min(among ? value : kNoTick);
    among = among && value == lowest;
  };
  keep_lowest(event.generation);
  keep_lowest(event.low_id);
  keep_lowest(event.high_id);
  return first_among();
}

// First of the events of a warp's lanes, in all of them.
__device__ __forceinline__ OrderedEvent first_of_warp(const OrderedEvent& event) {
  const unsigned lane = first_lane(event);
  if (lane == 32) return {};
  const auto of_lane = [&](std::uint32_t value) { return __shfl_sync(kWholeWarp, value, lane); };
  return {{of_lane(event.tick), of_lane(event.generation), of_lane(event.low_id), of_lane(event.high_id)},
          of_lane(event.place)};
}

// First of the events of a block's threads, in all of them. space: of each warp, in the block's shared
// memory; it may be written again after the next barrier.
__device__ __forceinline__ OrderedEvent first_of_block(const OrderedEvent& event,
                                                       OrderedEvent (&space)[kExactBlock / 32]) {
  OrderedEvent best = first_of_warp(event);
  if (threadIdx.x % 32 == 0) space[threadIdx.x / 32] = best;
  __syncthreads();
  for (const OrderedEvent& other : space) {
    if (comes_before(other, best)) best = other;
  }
  return best;
}

}  // namespace pf::cuda
