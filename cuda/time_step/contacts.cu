// Touching pairs, and the sums of their contacts.
#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/launch.cuh"
#include "cuda/tally.cuh"
#include "cuda/time_step/device_contacts.cuh"
#include "model/for_boundary.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

constexpr unsigned kContactBlock = 128;
constexpr unsigned kListsOfWarp = 4;  // that a warp of contact_kernel works off together
static_assert(kReadTogether - 1 <= kReadBeyond);

__device__ bool is_copy(const StepLaunch& launch, std::uint32_t i) {
  return (launch.from.id[i] & kCopyBit) != 0;
}

// How many parcels find_pairs_kernel looks around.
template <bool kBorders>
__device__ std::uint32_t num_searched(const StepLaunch& launch) {
  return kBorders ? launch.num_near : launch.num;
}

// How many of them, and at most how many pairs, a list is for.
template <bool kBorders>
__device__ std::uint32_t list_size(const StepLaunch& launch, std::uint32_t list) {
  return min(kPairList, num_searched<kBorders>(launch) - list * kPairList);
}

// Bound on displacements along an axis since the sort, position units; kHalfSide: parcels may be anywhere.
__device__ std::int32_t displacement_since_sort(const StepState& state) {
  const auto bound = static_cast<unsigned long long>(__ldg(&state.max_displacement));
  constexpr std::uint32_t kMost = kHalfSide;
  return static_cast<std::int32_t>(bound >> 32 != 0 ? kMost : min(static_cast<std::uint32_t>(bound), kMost));
}

// Calls visit(i, j) for each pair that touches, once: those of the k-th parcel i. Without kBorders pairs of
// own parcels, j after i; with it pairs of an own parcel near others' and a copy. They are within the float's
// margin of touching.
template <bool kBorders, Boundary kBoundary, class Visit>
__device__ __forceinline__ void visit_pairs(const StepLaunch& launch, std::uint32_t k, Visit visit) {
  const std::uint32_t i = kBorders ? launch.near[k] : k;
  const Vec2i* position = launch.from.position;
  const std::int32_t displacement = displacement_since_sort(*launch.state);  // on its way with the position
  const int2 there = __ldg(reinterpret_cast<const int2*>(position) + i);
  const Vec2i centre{there.x, there.y};
  if (is_retired(centre)) return;
  const bool is_inside = centre.x >= launch.low_without_copies && centre.x < launch.high_without_copies;
  if (kBorders && is_inside) return;
  const SearchCircle circle{centre, i, search_reach(launch.constants, displacement),
                            launch.constants.filter_distance2};
  if constexpr (kBorders) {
    search<kBoundary, true>(launch.space, position, circle, [&](std::uint32_t j) {
      if (is_copy(launch, j)) visit(i, j);
    });
  } else {
    search_later<kBoundary>(launch.space, position, circle, displacement, [&](std::uint32_t j) {
      if (is_inside || !(is_copy(launch, i) || is_copy(launch, j))) visit(i, j);
    });
  }
}

// A bit of a word for each parcel.
__device__ std::uint32_t bit_of(std::uint32_t i) { return 1U << (i % 32); }

// Marks a parcel that touches another one; returns the word before.
__device__ std::uint32_t mark_touched(const ContactScratch& contacts, std::uint32_t i) {
  return atomicOr(&contacts.touched[i / 32], bit_of(i));
}

// The sums of a parcel start at zero when it is marked first.
__device__ void begin_sums(const ContactScratch& contacts, std::uint32_t i, std::uint32_t touched_before) {
  if ((touched_before & bit_of(i)) == 0) sums_of(contacts, i) = {};
}

template <bool kBorders, Boundary kBoundary>
__global__ void __launch_bounds__(kPairList,
                                  blocks_per_sm(kBoundary == Boundary::periodic ? 12 : 16, kPairList))
    find_pairs_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  const std::uint32_t base = blockIdx.x * kPairList;
  const ContactScratch& contacts = launch.contacts;
  const std::uint32_t num_in_list = list_size<kBorders>(launch, blockIdx.x);
  if (threadIdx.x < num_in_list) {
    visit_pairs<kBorders, kBoundary>(launch, base + threadIdx.x, [&](std::uint32_t i, std::uint32_t j) {
      asm volatile("" : "+r"(i));  // what follows from i is not computed ahead: few parcels touch
      // Three atomics are waited for together.
      const std::uint32_t before_i = mark_touched(contacts, i), before_j = mark_touched(contacts, j);
      const unsigned slot = atomicAdd(&contacts.num_pairs[blockIdx.x], 1U);
      begin_sums(contacts, i, before_i);
      begin_sums(contacts, j, before_j);
      if (slot >= num_in_list) return;
      contacts.first[base + slot] = i;
      contacts.second[base + slot] = j;
    });
  }
}

__device__ void add_to(unsigned long long& sum, std::int64_t counts) {
  if (counts != 0) atomicAdd(&sum, static_cast<unsigned long long>(counts));
}

__device__ void add_sums(const ContactScratch& contacts, std::uint32_t i, const ContactSums& sums,
                         std::int64_t sign) {
  // Stands for a push out of range in 56 bits, as INT64_MIN does in 64: it is its own opposite there.
  constexpr std::int64_t kOutOfRange = -(1LL << (kCountShift - 1));
  const std::int64_t push_x = sums.push_x == INT64_MIN ? kOutOfRange : sign * sums.push_x;
  DeviceSums& to = sums_of(contacts, i);
  add_to(to.velocity_x, sign * sums.velocity_x);
  add_to(to.velocity_y, sign * sums.velocity_y);
  add_to(to.counted_push_x, push_x + (static_cast<std::int64_t>(sums.num_contacts) << kCountShift));
  add_to(to.push_y, sign * sums.push_y);
}

// Whether two parcels of a thin periodic world see each other in the same direction, half a period away.
template <Boundary kBoundary>
__device__ bool is_half_around(const World& world, Vec2i offset) {
  return kBoundary == Boundary::periodic && (offset.x == -world.half.x || offset.y == -world.half.y);
}

__device__ Parcel parcel_at(const StepLaunch& launch, std::uint32_t i) {
  const ParcelPointers& parcels = launch.from;
  return {parcels.position[i], parcels.velocity[i], parcels.id[i] & kIdBits, is_heated(parcels, i)};
}

// The contact of parcel i with parcel j, seen from i alone.
template <class Contact, Boundary kBoundary>
__device__ __noinline__ void touch_one_sided(const StepLaunch& launch, std::uint32_t i, std::uint32_t j,
                                             DeviceTally& tally) {
  const Parcel self = parcel_at(launch, i), other = parcel_at(launch, j);
  if (is_retired(self.position)) return;
  ContactSums sums;
  add_contact<Contact>(launch.constants, self, other,
                       separation<kBoundary>(launch.constants.physics.world, self.position, other.position),
                       sums, tally);
  add_sums(launch.contacts, i, sums, 1);
}

// Adds the contact of two parcels to the sums of both, if they touch; with kBorders j is a copy, without
// sums. What i gains j loses, to the bit: all that is computed changes its sign with the side that it is seen
// from. Ids are not read for that, since they matter for coincident centres only, and to tally a pair once.
template <class Contact, bool kBorders, Boundary kBoundary>
__device__ void touch(const StepLaunch& launch, std::uint32_t i, std::uint32_t j, DeviceTally& tally) {
  if (kBorders) {
    DeviceTally of_pair = tally;  // a copy, since what is passed by reference cannot stay in registers
    touch_one_sided<Contact, kBoundary>(launch, i, j, of_pair);
    tally = of_pair;
    return;
  }
  const ParcelPointers& parcels = launch.from;
  const Parcel one{parcels.position[i], parcels.velocity[i], 0, is_heated(parcels, i)},
      two{parcels.position[j], parcels.velocity[j], 1, is_heated(parcels, j)};
  if (is_retired(one.position)) return;
  const World& world = launch.constants.physics.world;
  const Vec2i offset = separation<kBoundary>(world, one.position, two.position);
  if (offset == Vec2i{} || is_half_around<kBoundary>(world, offset)) {
    DeviceTally of_pair = tally;
    touch_one_sided<Contact, kBoundary>(launch, i, j, of_pair);
    touch_one_sided<Contact, kBoundary>(launch, j, i, of_pair);
    tally = of_pair;
    return;
  }
  ContactSums sums;
  add_contact<Contact>(launch.constants, one, two, offset, sums, tally);
  add_sums(launch.contacts, i, sums, 1);
  add_sums(launch.contacts, j, sums, -1);
}

// The pairs of a list that is too short: they are found once more. Not inlined: the kernel would need
// more registers for what is rare.
template <class Contact, bool kBorders, Boundary kBoundary>
__device__ __noinline__ void touch_crowd(const StepLaunch& launch, std::uint32_t list, DeviceTally& tally) {
  const std::uint32_t num = list_size<kBorders>(launch, list);
  for (std::uint32_t k = threadIdx.x % 32; k < num; k += 32) {
    visit_pairs<kBorders, kBoundary>(launch, list * kPairList + k, [&](std::uint32_t i, std::uint32_t j) {
      touch<Contact, kBorders, kBoundary>(launch, i, j, tally);
    });
  }
}

// The pairs of kListsOfWarp lists at a time, by one warp: a thread for each pair.
template <class Contact, bool kBorders, Boundary kBoundary>
__device__ void touch_listed(const StepLaunch& launch, std::uint32_t first_list, std::uint32_t num_lists,
                             DeviceTally& tally) {
  constexpr unsigned kWarp = 0xFFFFFFFFU;
  const ContactScratch& contacts = launch.contacts;
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t list = first_list + lane;
  std::uint32_t num = lane < kListsOfWarp && list < num_lists ? contacts.num_pairs[list] : 0;
  if (num != 0) contacts.num_pairs[list] = 0;
  const bool is_crowded = num != 0 && num > list_size<kBorders>(launch, list);
  unsigned crowded = __ballot_sync(kWarp, is_crowded);
  if (is_crowded) num = 0;
  for (; crowded != 0; crowded &= crowded - 1) {
    const auto of = static_cast<std::uint32_t>(__ffs(static_cast<int>(crowded)) - 1);
    DeviceTally of_crowd = tally;
    touch_crowd<Contact, kBorders, kBoundary>(launch, first_list + of, of_crowd);
    tally = of_crowd;
  }
  std::uint32_t end = num;
  for (unsigned offset = 1; offset < kListsOfWarp; offset *= 2) {
    const std::uint32_t before = __shfl_up_sync(kWarp, end, offset);
    if (lane >= offset) end += before;
  }
  const std::uint32_t num_all = __shfl_sync(kWarp, end, kListsOfWarp - 1);
  for (std::uint32_t base = 0; base < num_all; base += 32) {
    const std::uint32_t pair = base + lane;
    std::uint32_t at = first_list * kPairList + pair;  // of the pair, if it is in the first list
#pragma unroll
    for (unsigned k = 0; k + 1 < kListsOfWarp; ++k) {
      const std::uint32_t list_end = __shfl_sync(kWarp, end, k);
      if (pair >= list_end) at = (first_list + k + 1) * kPairList + pair - list_end;
    }
    if (pair >= num_all) continue;
    touch<Contact, kBorders, kBoundary>(launch, contacts.first[at], contacts.second[at], tally);
  }
}

template <class Contact, bool kBorders, Boundary kBoundary>
__global__ void __launch_bounds__(kContactBlock)
    contact_kernel(const __grid_constant__ StepLaunch launch, std::uint32_t num_lists) {
  begin_in_turn();
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  DeviceTally tally{&block_tally};
  const std::uint32_t list = (blockIdx.x * kContactBlock + threadIdx.x) / 32 * kListsOfWarp;
  if (list < num_lists) touch_listed<Contact, kBorders, kBoundary>(launch, list, num_lists, tally);
  reduce_warp(tally, block_tally);
  __syncthreads();
  if (threadIdx.x == 0) add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
}

template <class Contact, bool kBorders, Boundary kBoundary>
void launch_pairs(const StepLaunch& launch, cudaStream_t stream) {
  const std::uint32_t num = kBorders ? launch.num_near : launch.num;
  if (num == 0) return;
  const unsigned num_lists = blocks_for(num, kPairList);
  launch_in_turn(find_pairs_kernel<kBorders, kBoundary>, num_lists, kPairList, stream, launch);
  launch_in_turn(contact_kernel<Contact, kBorders, kBoundary>,
                 blocks_for(num_lists, kContactBlock / 32 * kListsOfWarp), kContactBlock, stream, launch,
                 num_lists);
}

template <bool kBorders>
void launch_for(const StepLaunch& launch, cudaStream_t stream) {
  const Physics& physics = launch.constants.physics;
  if (!physics.parcels.contacts) return;
  for_boundary(physics.world.boundary, [&]<Boundary kBoundary>() {
    for_method(TimeStepMethods{}, launch.method,
               [&]<class M>() { launch_pairs<typename M::Contact, kBorders, kBoundary>(launch, stream); });
  });
}

}  // namespace

void launch_contacts(const StepLaunch& launch, cudaStream_t stream) { launch_for<false>(launch, stream); }

void launch_border_contacts(const StepLaunch& launch, cudaStream_t stream) {
  launch_for<true>(launch, stream);
}

}  // namespace pf
