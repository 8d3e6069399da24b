// Lists of the parcels that touch.
//
// A thread looks around one parcel, or in a large run around two that follow each other in the order of the
// sort. Their candidates are nearly the same, so that to read them and to find their cells is done once: 240
// instructions for 32 parcels instead of 301 (gas of 10^7, area fraction 0.2). Figures are of an H200.
#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/cuda_devices.hpp"
#include "cuda/launch.cuh"
#include "cuda/time_step/pairs.cuh"
#include "model/for_boundary.hpp"
#include "model/kinetic_theory.hpp"

namespace pf {
namespace {

// Marks a parcel that touches another one; returns the word before.
__device__ std::uint32_t mark_touched(const ContactScratch& contacts, std::uint32_t i) {
  return atomicOr(&contacts.touched[i / 32], bit_of(i));
}

// Returns true if it has not touched two before.
__device__ bool mark_touched_again(const ContactScratch& contacts, std::uint32_t i) {
  return (atomicOr(&contacts.touched_again[i / 32], bit_of(i)) & bit_of(i)) == 0;
}

// Follows mark_touched(). The sums of a parcel that touches a single one are stored by contact_kernel; those
// of others start at zero here or in clear_few_kernel, and contacts are added. At borders sums may have been
// stored already, and are always added to.
template <bool kBorders, bool kSorts>
__device__ void begin_sums(const ContactScratch& contacts, std::uint32_t i, std::uint32_t touched_before) {
  const bool is_first = (touched_before & bit_of(i)) == 0;
  const bool starts = kBorders ? is_first : !is_first && mark_touched_again(contacts, i);
  if (starts && !kSorts) sums_of(contacts, i) = {};
}

// Notes a pair for which its list has no room.
__device__ __forceinline__ void pool_pair(const ContactScratch& contacts, std::uint32_t i, std::uint32_t j) {
  if (__ldcg(contacts.num_pooled) > contacts.max_pooled)
    return;  // full: so that it does not overflow, either
  const unsigned slot = atomicAdd(contacts.num_pooled, 1U);
  if (slot >= contacts.max_pooled) return;
  contacts.pooled_first[slot] = i;
  contacts.pooled_second[slot] = j;
}

// Notes a pair that touches, in a list.
template <bool kBorders, bool kSorts>
__device__ __forceinline__ void note_pair(const StepLaunch& launch, std::uint32_t list, std::uint32_t i,
                                          std::uint32_t j) {
  asm volatile("" : "+r"(i));  // what follows from i is not computed ahead: few parcels touch
  const ContactScratch& contacts = launch.contacts;
  // Three atomics are waited for together.
  const std::uint32_t before_i = mark_touched(contacts, i), before_j = mark_touched(contacts, j);
  const unsigned slot = atomicAdd(&contacts.num_pairs[list], 1U);
  begin_sums<kBorders, kSorts>(contacts, i, before_i);
  begin_sums<kBorders, kSorts>(contacts, j, before_j);
  if (slot < list_size<kBorders>(launch, list)) {
    contacts.first[list * kPairList + slot] = i;
    contacts.second[list * kPairList + slot] = j;
  } else if (!kBorders) {
    pool_pair(contacts, i, j);
  }
}

// Notes the pairs of the k-th parcel.
template <bool kBorders, bool kSorts, Boundary kBoundary>
__device__ __forceinline__ void note_pairs_of(const StepLaunch& launch, std::uint32_t k) {
  visit_pairs<kBorders, kBoundary>(launch, k, [&](std::uint32_t i, std::uint32_t j) {
    note_pair<kBorders, kSorts>(launch, k / kPairList, i, j);
  });
}

template <bool kBorders, bool kSorts, Boundary kBoundary>
__global__ void __launch_bounds__(kPairList,
                                  blocks_per_sm(kBoundary == Boundary::periodic ? 12 : 16, kPairList))
    find_pairs_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  // From the last parcels on, since what the move before has written last may still be in the cache.
  const std::uint32_t k = (gridDim.x - 1 - blockIdx.x) * kPairList + threadIdx.x;
  if constexpr (kSorts) prepare_sort(launch, k);
  if (k < num_searched<kBorders>(launch)) note_pairs_of<kBorders, kSorts, kBoundary>(launch, k);
}

// Notes the pairs of parcels i and i + 1 one by one. Not inlined: few need it.
template <bool kSorts, Boundary kBoundary>
__device__ __noinline__ void note_pairs_one_by_one(const StepLaunch& launch, std::uint32_t i) {
  for (std::uint32_t k = i; k < min(i + 2, launch.num); ++k)
    note_pairs_of<false, kSorts, kBoundary>(launch, k);
}

constexpr unsigned kBlockForTwo = 128;
static_assert(kPairList % 2 == 0, "both parcels are of one list");

// 32 registers, some of them spilled before the loop over candidates: 39.6 Gps of a gas of 10^7, with
// 40 38.8, with 48 37.4. In a periodic world 40 registers.
template <bool kSorts, Boundary kBoundary>
__global__ void __launch_bounds__(kBlockForTwo,
                                  blocks_per_sm(kBoundary == Boundary::periodic ? 12 : 16, kBlockForTwo))
    find_pairs_of_two_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  const std::uint32_t base = (gridDim.x - 1 - blockIdx.x) * kBlockForTwo * 2;
  if constexpr (kSorts) {
    prepare_sort(launch, base + threadIdx.x);
    prepare_sort(launch, base + kBlockForTwo + threadIdx.x);
  }
  const std::uint32_t i = base + 2 * threadIdx.x;
  if (i >= launch.num) return;
  const bool are_noted = visit_pairs_of_two<kBoundary>(launch, i, [&](std::uint32_t of, std::uint32_t j) {
    note_pair<false, kSorts>(launch, i / kPairList, of, j);
  });
  if (!are_noted) note_pairs_one_by_one<kSorts, kBoundary>(launch, i);
}

// From so many parcels on a thread looks around two. Gps of one and of two: 4.5 10^5 20.3 and 18.5, 10^6 28.9
// and 28.5, 10^7 36.5 and 39.9, 10^8 37.8 and 41.4; 10^7 in a periodic world 28.6 and 35.9, at area fraction
// 0.35 29.6 and 32.4.
constexpr std::uint32_t kManyForTwo = 1'500'000;

template <bool kSorts, Boundary kBoundary>
void launch_for_own(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.by_two)
    launch_in_turn(find_pairs_of_two_kernel<kSorts, kBoundary>, blocks_for(launch.num, 2 * kBlockForTwo),
                   kBlockForTwo, stream, launch);
  else
    launch_in_turn(find_pairs_kernel<false, kSorts, kBoundary>, blocks_for(launch.num, kPairList), kPairList,
                   stream, launch);
}

}  // namespace

bool searches_by_two(const Physics& physics, std::uint32_t num_parcels) {
  if (const std::uint32_t many = device_limits().many_for_two; many > 0) return num_parcels >= many;
  return num_parcels >= kManyForTwo && area_fraction_of(physics) >= kThinForTwo;
}

void launch_find_pairs(const StepLaunch& launch, bool at_borders, cudaStream_t stream) {
  for_boundary(launch.constants.physics.world.boundary, [&]<Boundary kBoundary>() {
    if (at_borders)
      launch_in_turn(find_pairs_kernel<true, false, kBoundary>, blocks_for(launch.num_near, kPairList),
                     kPairList, stream, launch);
    else if (launch.sort.is_due)
      launch_for_own<true, kBoundary>(launch, stream);
    else
      launch_for_own<false, kBoundary>(launch, stream);
  });
}

}  // namespace pf
