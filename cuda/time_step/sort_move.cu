// The move of parcels whose contacts are summed, each to its place in the order of a new sort.
#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/launch.cuh"
#include "cuda/tally.cuh"
#include "cuda/time_step/device_contacts.cuh"
#include "model/methods.hpp"

namespace pf {
namespace {

// Values that the threads of a block share; its parcels are those of a list of pairs.
struct OfList {
  std::uint32_t key;
  uint4 touched;
};

// Sums of the contacts of parcel i, found by a search. Not inlined: only in a crowd parcels need it.
template <class Contact, Boundary kBoundary>
__device__ __noinline__ ContactSums search_sums(const StepLaunch& launch, std::uint32_t i) {
  const Parcel self = parcel_at(launch, i);
  const SearchCircle circle{self.position, i, search_reach(launch.constants, displacement_since_sort(launch)),
                            launch.constants.filter_distance2};
  ContactSums sums;
  DeviceTally counted{nullptr};  // by contact_kernel
  search<kBoundary, true>(launch.space, launch.from.position, circle, [&](std::uint32_t j) {
    touch_from<Contact, kBoundary>(launch, self, j, sums, counted);
  });
  return sums;
}

template <class Contact, Boundary kBoundary>
__device__ ContactEffect contact_effect(const StepLaunch& launch, std::uint32_t i, Vec2f velocity,
                                        const OfList& list) {
  if (!has_bit(list.touched, i)) return effect_of_none(velocity);
  const DeviceSums* const sums = few_sums_of(launch.contacts, i, list.touched);
  return effect_of(launch.constants, velocity,
                   sums != nullptr ? as_sums(*sums) : search_sums<Contact, kBoundary>(launch, i));
}

template <class Contact, bool kBall, Boundary kBoundary>
__global__ void __launch_bounds__(kPairList, blocks_per_sm(8, kPairList))
    sort_move_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  __shared__ TallySlot block_tally;
  __shared__ OfList list;
  const std::uint32_t i = blockIdx.x * kPairList + threadIdx.x;
  const bool is_parcel = i < launch.num;
  Parcel before{};
  if (is_parcel) before = parcel_with_bits(launch.from, i);
  if (threadIdx.x == 0) {
    block_tally = {};
    list = {key_of(launch), words_of_list(launch.contacts.touched, blockIdx.x)};
    if (blockIdx.x == 0) note_displacement(launch);
  }
  // Asked for early, since it takes as long as the parcel itself.
  const std::uint32_t place = place_of(launch, before.position, is_parcel);
  __syncthreads();
  DeviceTally tally{&block_tally};
  if (is_parcel) {
    Parcel after = before;
    if (!is_retired(before.position)) {
      const ContactEffect effect = contact_effect<Contact, kBoundary>(launch, i, before.velocity, list);
      after = finish_step<kBall, kBoundary>(launch.constants, launch.state->motion, list.key, before, effect,
                                            tally);
    }
    put_in_place(launch, place, after);
  }
  clear_pool(launch.contacts);
  add_block(launch, tally, block_tally);
  if (threadIdx.x == 0) clear_touched(launch.contacts, blockIdx.x);
}

}  // namespace

void launch_move_and_sort(const StepLaunch& launch, cudaStream_t stream) {
  for_terms(launch.constants.physics, launch.method, [&]<class Contact, bool kBall, Boundary kBoundary>() {
    if constexpr (has_contacts<Contact>) {  // else nothing is ever sorted
      launch_in_turn(sort_move_kernel<Contact, kBall, kBoundary>, blocks_for(launch.num, kPairList),
                     kPairList, stream, launch);
    }
  });
}

}  // namespace pf
