// The move of parcels whose contacts are summed, in place.
#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/launch.cuh"
#include "cuda/tally.cuh"
#include "cuda/time_step/device_contacts.cuh"
#include "model/for_boundary.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

constexpr unsigned kMoveBlock = 128;
constexpr unsigned kPerThread = 2;  // parcels, to wait for memory once

__device__ bool is_same(Vec2f a, Vec2f b) {
  return __float_as_uint(a.x) == __float_as_uint(b.x) && __float_as_uint(a.y) == __float_as_uint(b.y);
}

// Moves and draws a parcel. Returns whether it is heated then; of a ghost it does not matter.
template <bool kBall, Boundary kBoundary>
__device__ __forceinline__ bool move_parcel(const StepLaunch& launch, const std::uint32_t& key,
                                            std::uint32_t i, Parcel before, const ContactEffect& effect,
                                            DeviceTally& tally) {
  const bool is_ghost = (before.id & kGhostBit) != 0;
  bool is_heated_after = false;
  before.id &= kIdBits;
  Parcel after = before;
  if (!is_retired(before.position) && !is_ghost) {
    after = finish_step<kBall, kBoundary>(launch.constants, launch.state->motion, key, before, effect, tally);
    store_at_once(launch.from.position[i], after.position);
    if (!is_same(after.velocity, before.velocity)) store_at_once(launch.from.velocity[i], after.velocity);
    is_heated_after = after.is_heated != 0;
  }
  draw_moved(launch, i, after);
  return is_heated_after;
}

__device__ ContactEffect effect_on(const StepLaunch& launch, std::uint32_t i, Vec2f velocity) {
  return effect_of(launch.constants, velocity, as_sums(sums_of(launch.contacts, i)));
}

// The effect on one of a thread's parcels: the first one of them that touches another parcel. One of 20 does.
// Most warps have such a parcel, but few threads have two, so that this is computed once for both parcels of
// a thread. With a ball there are no registers for it, and in a court few warps have any.
__device__ __forceinline__ ContactEffect first_effect(const StepLaunch& launch, std::uint32_t base,
                                                      const Parcel (&parcels)[kPerThread],
                                                      const bool (&touches)[kPerThread]) {
  static_assert(kPerThread == 2);
  if (!touches[0] && !touches[1]) return {};
  return effect_on(launch, base + (touches[0] ? 0 : kMoveBlock),
                   touches[0] ? parcels[0].velocity : parcels[1].velocity);
}

// With a ball 64 registers, else 32, so that no value is spilled. Microseconds with a ball in the court of
// 10^7 on an H200: 99 with 64, 187 with 40, 202 with 32.
template <bool kBall, Boundary kBoundary>
__global__ void __launch_bounds__(kMoveBlock, blocks_per_sm(kBall ? 8 : 16, kMoveBlock))
    move_kernel(const __grid_constant__ StepLaunch launch) {
  const std::uint32_t base = blockIdx.x * kMoveBlock * kPerThread + threadIdx.x;
  Parcel parcels[kPerThread];
  // They are on their way while contact_kernel works, which does not write them.
  if (!launch.constants.physics.parcels.contacts) begin_in_turn();
#pragma unroll
  for (unsigned k = 0; k < kPerThread; ++k) {
    const std::uint32_t i = base + k * kMoveBlock;
    if (i < launch.num) parcels[k] = parcel_with_bits(launch.from, i);
  }
  begin_in_turn();
  __shared__ TallySlot block_tally;
  __shared__ std::uint32_t key;
  if (threadIdx.x == 0) {
    block_tally = {};
    key = key_of(launch);
    if (blockIdx.x == 0) note_displacement(launch);
  }
  __syncthreads();
  DeviceTally tally{&block_tally};
  std::uint32_t touched[kPerThread];
  bool touches[kPerThread];
#pragma unroll
  for (unsigned k = 0; k < kPerThread; ++k) {
    const std::uint32_t i = base + k * kMoveBlock;
    if (i < launch.num) touched[k] = launch.contacts.touched[i / 32];
    touches[k] = i < launch.num && (touched[k] & bit_of(i)) != 0;
  }
  ContactEffect first{};
  if constexpr (!kBall) first = first_effect(launch, base, parcels, touches);
  __syncwarp();
#pragma unroll
  for (unsigned k = 0; k < kPerThread; ++k) {
    const std::uint32_t i = base + k * kMoveBlock;
    bool is_heated_after = false;
    if (i < launch.num) {
      ContactEffect effect = effect_of_none(parcels[k].velocity);
      const bool is_first = !kBall && (k == 0 || !touches[0]);
      if (touches[k]) effect = is_first ? first : effect_on(launch, i, parcels[k].velocity);
      is_heated_after = move_parcel<kBall, kBoundary>(launch, key, i, parcels[k], effect, tally);
    }
    set_heated_of_warp(launch.from, i, is_heated_after, launch.num);
  }
  clear_pool(launch.contacts);
  add_block(launch, tally, block_tally);
  // Behind a barrier in add_block no thread reads these words.
  static_assert(kMoveBlock == kPairList);
  const std::uint32_t list = blockIdx.x * kPerThread + threadIdx.x;
  if (threadIdx.x < kPerThread && list * kPairList < launch.num) clear_touched(launch.contacts, list);
}

}  // namespace

void launch_move(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.num == 0) return;
  if (launch.sort.is_due) {
    launch_move_and_sort(launch, stream);
    return;
  }
  const unsigned num_blocks = blocks_for(launch.num, kMoveBlock * kPerThread);
  const Physics& physics = launch.constants.physics;
  for_boundary(physics.world.boundary, [&]<Boundary kBoundary>() {
    const auto kernel = physics.ball.exists ? move_kernel<true, kBoundary> : move_kernel<false, kBoundary>;
    launch_in_turn(kernel, num_blocks, kMoveBlock, stream, launch);
  });
}

}  // namespace pf
