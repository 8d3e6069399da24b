// A step of one kernel in which blocks work off the contacts of their parcels together. A thread has one
// parcel, or two that follow each other in the order of the sort.
#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/cuda_devices.hpp"
#include "cuda/launch.cuh"
#include "cuda/time_step/block_contacts.cuh"
#include "model/for_boundary.hpp"
#include "model/kinetic_theory.hpp"
#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// 12 blocks limit registers to 40, 8 to 64. When each warp worked by itself, Gps of `spring` with two parcels
// to a thread, 10^6 and 10^7: 12 blocks 22.5, 32.2; 10 blocks 22.6, 31.1. With one, 10^5: 10.7; with 16 8.0.
// With a ball, ms a frame of the court of 2 10^5 with one, restitution 0.2: 12 blocks 0.69, 10 0.61, 8 0.56.
constexpr unsigned kBlock = kSharingBlock;
template <bool kBall>
constexpr unsigned kBlocksPerSm = blocks_per_sm(kBall ? 8 : 12, kBlock);

// A thread's parcels, i and following. Those from launch.num on do not exist.
template <unsigned kPerThread>
struct Parcels {
  Parcel of[kPerThread];
};

template <unsigned kPerThread>
__device__ __forceinline__ Parcels<kPerThread> load_parcels(const StepLaunch& launch, std::uint32_t i) {
  Parcels<kPerThread> parcels;
  const ParcelPointers& from = launch.from;
  if constexpr (kPerThread == 2) {
    if (i + 1 < launch.num) {
      const int4 position = *reinterpret_cast<const int4*>(from.position + i);
      const float4 velocity = *reinterpret_cast<const float4*>(from.velocity + i);
      const uint2 id = *reinterpret_cast<const uint2*>(from.id + i);
      parcels.of[0] = Parcel{{position.x, position.y}, {velocity.x, velocity.y}, id.x};
      parcels.of[1] = Parcel{{position.z, position.w}, {velocity.z, velocity.w}, id.y};
      return parcels;
    }
  }
  if (i < launch.num) parcels.of[0] = {from.position[i], from.velocity[i], from.id[i]};
  return parcels;
}

template <unsigned kPerThread>
__device__ __forceinline__ void store_parcels(const StepLaunch& launch, std::uint32_t i,
                                              const Parcels<kPerThread>& parcels) {
  const ParcelPointers& to = launch.to;
  const Parcel& one = parcels.of[0];
  if constexpr (kPerThread == 2) {
    if (i + 1 < launch.num) {
      const Parcel& two = parcels.of[1];
      *reinterpret_cast<int4*>(to.position + i) = {one.position.x, one.position.y, two.position.x,
                                                   two.position.y};
      *reinterpret_cast<float4*>(to.velocity + i) = {one.velocity.x, one.velocity.y, two.velocity.x,
                                                     two.velocity.y};
      return;
    }
  }
  if (i >= launch.num) return;
  to.position[i] = one.position;
  to.velocity[i] = one.velocity;
}

// Sets the bits of a warp's parcels, of which first is the first one. Whole warps call it.
template <class Contact, unsigned kPerThread>
__device__ __forceinline__ void set_heated_of_parcels(const StepLaunch& launch, std::uint32_t first,
                                                      const Parcels<kPerThread>& parcels) {
  const unsigned lane = threadIdx.x % 32;
  if constexpr (!Contact::kPushes) {  // nor does it heat
    const std::uint32_t i = first + lane * 32;
    if (lane < kPerThread && i < launch.num) launch.to.heated[i / 32] = 0;
    return;
  }
  unsigned bits = 0;
#pragma unroll
  for (unsigned n = 0; n < kPerThread; ++n)
    bits |= first + lane * kPerThread + n < launch.num && parcels.of[n].is_heated != 0 ? 1U << n : 0U;
#pragma unroll
  for (unsigned part = 0; part < kPerThread; ++part) {
    const unsigned of = part * 32 + lane;  // parcel of the warp
    const unsigned of_thread = __shfl_sync(0xFFFFFFFFU, bits, static_cast<int>(of / kPerThread));
    set_heated_of_warp(launch.to, first + of, (of_thread >> (of % kPerThread) & 1U) != 0, launch.num);
  }
}

// Writes the parcels of a warp. Whole warps call it.
template <class Contact, unsigned kPerThread>
__device__ __forceinline__ void write_parcels(const StepLaunch& launch, std::uint32_t i,
                                              const Parcels<kPerThread>& before,
                                              const Parcels<kPerThread>& after) {
  if (launch.sort.is_due) {
#pragma unroll
    for (unsigned n = 0; n < kPerThread; ++n) {
      const std::uint32_t place = place_of(launch, before.of[n].position, i + n < launch.num);
      if (i + n < launch.num) put_in_place(launch, place, after.of[n]);
    }
    return;
  }
  store_parcels(launch, i, after);
  if (launch.draw.position_m != nullptr) {
#pragma unroll
    for (unsigned n = 0; n < kPerThread; ++n)
      if (i + n < launch.num) draw_moved(launch, i + n, after.of[n]);
  }
  set_heated_of_parcels<Contact>(launch, i - threadIdx.x % 32 * kPerThread, after);
}

template <class Contact, unsigned kPerThread, bool kBall, Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kBlocksPerSm<kBall>)
    step_of_block_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  __shared__ TallySlot block_tally;
  __shared__ OfStep of_step;
  __shared__ BlockContacts<Contact, kPerThread> contacts;
  const std::uint32_t first = blockIdx.x * kBlock * kPerThread, i = first + threadIdx.x * kPerThread;
  contacts.begin(first);
  if (threadIdx.x == 0) of_step = begin_block(launch, block_tally);
  __syncthreads();
  DeviceTally tally{&block_tally};
  sum_contacts_of_block<Contact, kPerThread, kBoundary>(launch, first, of_step.reach, contacts, tally);
  const Parcels<kPerThread> before = load_parcels<kPerThread>(launch, i);
  Parcels<kPerThread> after = before;
#pragma unroll
  for (unsigned n = 0; n < kPerThread; ++n) {
    if (i + n < launch.num && !is_retired(before.of[n].position))
      after.of[n] = finish_step<kBall, kBoundary>(launch.constants, launch.state->motion, of_step.key,
                                                  before.of[n], contacts.sums_of(n), tally);
  }
  write_parcels<Contact>(launch, i, before, after);
  add_block(launch, tally, block_tally);
}

// From so many parcels on two to a thread are faster than one. Gps of `spring` with one and with two: 6 10^5
// 20.9 and 21.0, 8 10^5 21.6 and 22.8, 10^6 22.0 and 24.1.
constexpr std::uint32_t kManyForTwoOfBlock = 600'000;
// With a ball so many parcels pay. Ms a frame of the court, of step_kernel and of warps: 2 10^4 0.15 and
// 0.17, 10^5 0.32 and 0.31, 2 10^5 0.53 and 0.54, at restitution 0.2 0.87 and 0.57; `spring`, 4 10^5 0.92 and
// 0.76, 6 10^5 1.02 and 1.00, 10^6 1.45 and 1.58.
constexpr std::uint32_t kFewForBlocksWithBall = 50'000, kManyForBlocksWithBall = 600'000;

template <unsigned kPerThread, bool kBall>
void launch_of_block(const StepLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.constants.physics.world.boundary, [&]<Boundary kBoundary>() {
    for_method(TimeStepMethods{}, launch.method, [&]<class M>() {
      launch_in_turn(step_of_block_kernel<typename M::Contact, kPerThread, kBall, kBoundary>,
                     blocks_for(launch.num, kPerThread * kBlock), kBlock, stream, launch);
    });
  });
}

}  // namespace

OneKernel choose_one_kernel(const Physics& physics, Method method, std::uint32_t num_parcels) {
  if (!physics.parcels.contacts) return OneKernel::plain;
  if (const std::uint32_t limit = device_limits().one_kernel; limit > 0)
    return static_cast<OneKernel>(limit - 1);
  if (physics.ball.exists)
    return num_parcels >= kFewForBlocksWithBall && num_parcels < kManyForBlocksWithBall ? OneKernel::of_block
                                                                                        : OneKernel::plain;
  const double area_fraction = area_fraction_of(physics);
  // In a thin gas of many parcels, which seldom touch, step_kernel is faster: at 0.05, 10^6 26.6 instead
  // of 24.5.
  const bool often_touch = row_of(method).contacts_last || area_fraction > kMaxAreaFraction;
  if (!often_touch || area_fraction < kThinForTwo) return OneKernel::plain;
  return num_parcels < kManyForTwoOfBlock ? OneKernel::of_block : OneKernel::two_of_block;
}

void launch_step_of_block(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.constants.physics.ball.exists)
    launch_of_block<1, true>(launch, stream);
  else if (launch.one_kernel == OneKernel::two_of_block)
    launch_of_block<2, false>(launch, stream);
  else
    launch_of_block<1, false>(launch, stream);
}

}  // namespace pf
