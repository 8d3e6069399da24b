// Touching pairs, and the sums of their contacts.
#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/launch.cuh"
#include "cuda/tally.cuh"
#include "cuda/time_step/device_ball.cuh"
#include "cuda/time_step/device_contacts.cuh"
#include "model/for_boundary.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

constexpr unsigned kContactBlock = 128;
// Lists that a warp of contact_kernel works off together. In a gas at area fraction 0.2 they have 2.9 pairs
// in the mean; by Poisson's law one in 280 has more than eight.
constexpr unsigned kListsOfWarp = 4, kThreadsOfList = 32 / kListsOfWarp;
static_assert(kReadTogether - 1 <= kReadBeyond);

__device__ bool is_ghost(const StepLaunch& launch, std::uint32_t i) {
  return (launch.from.id[i] & kGhostBit) != 0;
}

// Number of parcels that find_pairs_kernel looks around.
template <bool kBorders>
__device__ std::uint32_t num_searched(const StepLaunch& launch) {
  return kBorders ? launch.num_near : launch.num;
}

// Number of these parcels that a list is for, which is also its largest number of pairs.
template <bool kBorders>
__device__ std::uint32_t list_size(const StepLaunch& launch, std::uint32_t list) {
  return min(kPairList, num_searched<kBorders>(launch) - list * kPairList);
}

// Calls visit(i, j) for each pair that touches, once: those of the k-th parcel i. Without kBorders pairs of
// own parcels, j after i; with it pairs of an own parcel near others' and a ghost. They are within the
// float's margin of touching.
template <bool kBorders, Boundary kBoundary, class Visit>
__device__ __forceinline__ void visit_pairs(const StepLaunch& launch, std::uint32_t k, Visit visit) {
  const std::uint32_t i = kBorders ? launch.near[k] : k;
  const Vec2i* position = launch.from.position;
  const std::int32_t displacement = displacement_since_sort(launch);  // on its way with the position
  const int2 there = __ldg(reinterpret_cast<const int2*>(position) + i);
  const Vec2i centre{there.x, there.y};
  if (is_retired(centre)) return;
  const bool is_inside = centre.x >= launch.low_without_ghosts && centre.x < launch.high_without_ghosts;
  if (kBorders && is_inside) return;
  const SearchCircle circle{centre, i, search_reach(launch.constants, displacement),
                            launch.constants.filter_distance2};
  if constexpr (kBorders) {
    search<kBoundary, true>(launch.space, position, circle, [&](std::uint32_t j) {
      if (is_ghost(launch, j)) visit(i, j);
    });
  } else {
    search_later<kBoundary>(launch.space, position, circle, displacement, [&](std::uint32_t j) {
      if (is_inside || !(is_ghost(launch, i) || is_ghost(launch, j))) visit(i, j);
    });
  }
}

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

template <bool kBorders, bool kSorts, Boundary kBoundary>
__global__ void __launch_bounds__(kPairList,
                                  blocks_per_sm(kBoundary == Boundary::periodic ? 12 : 16, kPairList))
    find_pairs_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  // From the last list on, since what the move before has written last may still be in the cache.
  const std::uint32_t list = gridDim.x - 1 - blockIdx.x;
  const std::uint32_t base = list * kPairList;
  const ContactScratch& contacts = launch.contacts;
  const std::uint32_t num_in_list = list_size<kBorders>(launch, list);
  if constexpr (kSorts) prepare_sort(launch, base + threadIdx.x);
  if (threadIdx.x >= num_in_list) return;
  visit_pairs<kBorders, kBoundary>(launch, base + threadIdx.x, [&](std::uint32_t i, std::uint32_t j) {
    asm volatile("" : "+r"(i));  // what follows from i is not computed ahead: few parcels touch
    // Three atomics are waited for together.
    const std::uint32_t before_i = mark_touched(contacts, i), before_j = mark_touched(contacts, j);
    const unsigned slot = atomicAdd(&contacts.num_pairs[list], 1U);
    begin_sums<kBorders, kSorts>(contacts, i, before_i);
    begin_sums<kBorders, kSorts>(contacts, j, before_j);
    if (slot >= num_in_list) return;
    contacts.first[base + slot] = i;
    contacts.second[base + slot] = j;
  });
}

__device__ void add_to(unsigned long long& sum, unsigned long long counts) {
  if (counts != 0) atomicAdd(&sum, counts);
}

__device__ DeviceSums device_sums(const ContactSums& sums) {
  // Stands for a push out of range in 56 bits, as INT64_MIN does in 64: it is its own opposite there.
  constexpr std::int64_t kOutOfRange = -(1LL << (kCountShift - 1));
  const std::int64_t push_x = sums.push_x == INT64_MIN ? kOutOfRange : sums.push_x;
  const std::int64_t count = static_cast<std::int64_t>(sums.num_contacts) << kCountShift;
  return {static_cast<unsigned long long>(sums.velocity_x), static_cast<unsigned long long>(sums.velocity_y),
          static_cast<unsigned long long>(push_x + count), static_cast<unsigned long long>(sums.push_y)};
}

// The sums of parcel i; null: it has none.
__device__ DeviceSums* find_sums(const ContactScratch& contacts, std::uint32_t i) {
  if (contacts.few == nullptr) return &sums_of(contacts, i);
  return few_sums_of(contacts, i, words_of_list(contacts.touched, i / kPairList));
}

// In a step that sorts, where the sums lie is known only when all parcels that touch are marked.
__global__ void __launch_bounds__(kContactBlock)
    clear_few_kernel(const __grid_constant__ ContactScratch contacts, std::uint32_t num_words) {
  begin_in_turn();
  const std::uint32_t word = blockIdx.x * kContactBlock + threadIdx.x;
  if (word >= num_words) return;
  for (std::uint32_t again = contacts.touched_again[word]; again != 0; again &= again - 1) {
    const auto bit = static_cast<std::uint32_t>(__ffs(static_cast<int>(again)) - 1);
    DeviceSums* const sums = find_sums(contacts, word * 32 + bit);
    if (sums != nullptr) *sums = {};
  }
}

// Adds the sums of a contact to those of parcel i.
template <bool kBorders>
__device__ void add_sums(const ContactScratch& contacts, std::uint32_t i, const DeviceSums& added) {
  DeviceSums* const sums = find_sums(contacts, i);
  if (sums == nullptr) return;
  if (!kBorders && !has_bit(contacts.touched_again, i)) {
    *sums = added;
    return;
  }
  add_to(sums->velocity_x, added.velocity_x);
  add_to(sums->velocity_y, added.velocity_y);
  add_to(sums->counted_push_x, added.counted_push_x);
  add_to(sums->push_y, added.push_y);
}

// Returns whether two parcels of a thin periodic world see each other in the same direction, half a period
// away.
template <Boundary kBoundary>
__device__ bool is_half_around(const World& world, Vec2i offset) {
  return kBoundary == Boundary::periodic && (offset.x == -world.half.x || offset.y == -world.half.y);
}

// The contact of parcel i with parcel j, seen from i alone.
template <class Contact, bool kBorders, Boundary kBoundary>
__device__ __noinline__ void touch_one_sided(const StepLaunch& launch, std::uint32_t i, std::uint32_t j,
                                             DeviceTally& tally) {
  const Parcel self = parcel_at(launch, i);
  if (is_retired(self.position)) return;
  ContactSums sums;
  touch_from<Contact, kBoundary>(launch, self, j, sums, tally);
  add_sums<kBorders>(launch.contacts, i, device_sums(sums));
}

// Adds the contact of two parcels to the sums of both, if they touch; with kBorders j is a ghost, without
// sums. What i gains j loses, to the bit: all that is computed changes its sign with the side that it is seen
// from. Ids are not read for that, since they matter for coincident centres only, and to tally a pair once.
template <class Contact, bool kBorders, Boundary kBoundary>
__device__ void touch(const StepLaunch& launch, std::uint32_t i, std::uint32_t j, DeviceTally& tally) {
  if (kBorders) {
    DeviceTally of_pair = tally;  // a copy, since what is passed by reference cannot stay in registers
    touch_one_sided<Contact, kBorders, kBoundary>(launch, i, j, of_pair);
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
    touch_one_sided<Contact, kBorders, kBoundary>(launch, i, j, of_pair);
    touch_one_sided<Contact, kBorders, kBoundary>(launch, j, i, of_pair);
    tally = of_pair;
    return;
  }
  ContactSums sums;
  add_contact<Contact>(launch.constants, one, two, offset, sums, tally);
  add_sums<kBorders>(launch.contacts, i, device_sums(sums));
  add_sums<kBorders>(launch.contacts, j, device_sums(-sums));
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

struct Pair {
  std::uint32_t i, j;
};

__device__ Pair pair_at(const ContactScratch& contacts, std::uint32_t at) {
  return {contacts.first[at], contacts.second[at]};
}

// Index of the k-th pair in a warp's lists, if it exists.
struct PlaceInLists {
  std::uint32_t at;
  std::uint32_t num_all;  // pairs of these lists
};

// num: pairs of the thread's list. Whole warps call it.
__device__ PlaceInLists place_in_lists(std::uint32_t first_list, std::uint32_t num, std::uint32_t k) {
  PlaceInLists place{0, 0};
#pragma unroll
  for (unsigned of_warp = 0; of_warp < kListsOfWarp; ++of_warp) {
    if (k >= place.num_all) place.at = (first_list + of_warp) * kPairList + k - place.num_all;
    place.num_all += __shfl_sync(0xFFFFFFFFU, num, of_warp * kThreadsOfList);
  }
  return place;
}

// The pairs of kListsOfWarp lists, by one warp: a thread for each pair.
template <class Contact, bool kBorders, Boundary kBoundary>
__device__ void touch_listed(const StepLaunch& launch, std::uint32_t first_list, std::uint32_t num_lists,
                             DeviceTally& tally) {
  constexpr unsigned kWarp = 0xFFFFFFFFU;
  const ContactScratch& contacts = launch.contacts;
  const unsigned lane = threadIdx.x % 32, slot = lane % kThreadsOfList;
  const std::uint32_t list = first_list + lane / kThreadsOfList;
  const std::uint32_t size = list < num_lists ? list_size<kBorders>(launch, list) : 0;
  // Asked for together with the number of pairs. It is the thread's pair if no list has more than threads.
  Pair pair{};
  if (slot < size) pair = pair_at(contacts, list * kPairList + slot);
  std::uint32_t num = size > 0 ? contacts.num_pairs[list] : 0;
  __syncwarp();
  if (slot == 0 && num != 0) contacts.num_pairs[list] = 0;
  unsigned crowded = __ballot_sync(kWarp, slot == 0 && num > size);
  if (num > size) num = 0;
  const bool is_any_long = __any_sync(kWarp, num > kThreadsOfList);
  bool has_pair = slot < num;
  std::uint32_t num_all = 32;
  for (std::uint32_t base = 0; base < num_all; base += 32) {
    if (is_any_long) {
      const PlaceInLists place = place_in_lists(first_list, num, base + lane);
      num_all = place.num_all;
      has_pair = base + lane < num_all;
      if (has_pair) pair = pair_at(contacts, place.at);
    }
    if (has_pair) touch<Contact, kBorders, kBoundary>(launch, pair.i, pair.j, tally);
  }
  for (; crowded != 0; crowded &= crowded - 1) {
    const auto of = static_cast<std::uint32_t>(__ffs(static_cast<int>(crowded)) - 1);
    DeviceTally of_crowd = tally;
    touch_crowd<Contact, kBorders, kBoundary>(launch, first_list + of / kThreadsOfList, of_crowd);
    tally = of_crowd;
  }
}

// Number of blocks of contact_kernel that move the ball. They come before the others.
template <bool kBorders>
PF_HD unsigned num_blocks_for_ball(const StepLaunch& launch) {
  return !kBorders && contacts_move_ball(launch) ? 1 : 0;
}

// Not inlined: in a periodic world 40 bytes of a thread's registers would be spilled instead of 28. Otherwise
// registers are the same.
__device__ __noinline__ void move_ball_past_step_before(const StepLaunch& launch) {
  move_ball(launch.constants, launch.slots + (launch.num_open - 1) * kNumSlots, *launch.state);
}

// 10 blocks, as many as 48 registers allow: 36.3 Gps of a gas of 10^7 on an H200, with 8 36.0, with 12 35.8.
template <class Contact, bool kBorders, Boundary kBoundary>
__global__ void __launch_bounds__(kContactBlock, blocks_per_sm(10, kContactBlock))
    contact_kernel(const __grid_constant__ StepLaunch launch, std::uint32_t num_lists) {
  begin_when_complete();
  const unsigned num_for_ball = num_blocks_for_ball<kBorders>(launch);
  if (blockIdx.x < num_for_ball) {
    if (threadIdx.x < 32) move_ball_past_step_before(launch);
    return;
  }
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  DeviceTally tally{&block_tally};
  const unsigned block = blockIdx.x - num_for_ball;
  const std::uint32_t list = (block * kContactBlock + threadIdx.x) / 32 * kListsOfWarp;
  if (list < num_lists) touch_listed<Contact, kBorders, kBoundary>(launch, list, num_lists, tally);
  reduce_warp(tally, block_tally);
  __syncthreads();
  if (threadIdx.x == 0)
    add_slot(launch.slots[launch.num_open * kNumSlots + blockIdx.x % kNumSlots], block_tally);
}

template <class Contact, bool kBorders, Boundary kBoundary>
void launch_pairs(const StepLaunch& launch, cudaStream_t stream) {
  const std::uint32_t num = kBorders ? launch.num_near : launch.num;
  if (num == 0) return;
  const unsigned num_lists = blocks_for(num, kPairList);
  const auto find_pairs = !kBorders && launch.sort.is_due ? find_pairs_kernel<kBorders, !kBorders, kBoundary>
                                                          : find_pairs_kernel<kBorders, false, kBoundary>;
  launch_in_turn(find_pairs, num_lists, kPairList, stream, launch);
  if (launch.sort.is_due) {
    const std::uint32_t num_words = blocks_for(num, 32);
    launch_in_turn(clear_few_kernel, blocks_for(num_words, kContactBlock), kContactBlock, stream,
                   launch.contacts, num_words);
  }
  launch_in_turn(
      contact_kernel<Contact, kBorders, kBoundary>,
      num_blocks_for_ball<kBorders>(launch) + blocks_for(num_lists, kContactBlock / 32 * kListsOfWarp),
      kContactBlock, stream, launch, num_lists);
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
