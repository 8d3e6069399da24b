// The sums of the contacts of touching pairs.
#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/launch.cuh"
#include "cuda/tally.cuh"
#include "cuda/time_step/device_ball.cuh"
#include "cuda/time_step/device_contacts.cuh"
#include "cuda/time_step/pairs.cuh"
#include "model/for_boundary.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

constexpr unsigned kContactBlock = 128;
// Lists that a warp of contact_kernel works off together. In a gas at area fraction 0.2 they have 2.9 pairs
// in the mean; by Poisson's law one in 280 has more than eight.
constexpr unsigned kListsOfWarp = 4, kThreadsOfList = 32 / kListsOfWarp;

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
// sums. Ids are not read where one side is enough, since they matter for coincident centres only, and to
// tally a pair once.
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
  if (!is_same_from_both<kBoundary>(world, offset)) {
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

// The pairs of a list that is too short, if there was no room for what it lacks: they are found once more, in
// the same way, since the sums of a parcel that is marked have to be stored. Not inlined: the kernel would
// need more registers for what is rare.
template <class Contact, bool kBorders, Boundary kBoundary>
__device__ __noinline__ void touch_crowd(const StepLaunch& launch, std::uint32_t list, DeviceTally& tally) {
  const auto touch_pair = [&](std::uint32_t i, std::uint32_t j) {
    touch<Contact, kBorders, kBoundary>(launch, i, j, tally);
  };
  const std::uint32_t first = list * kPairList, end = first + list_size<kBorders>(launch, list);
  const unsigned num_together = launch.by_two ? 2 : 1;
  for (std::uint32_t k = first + threadIdx.x % 32 * num_together; k < end; k += 32 * num_together) {
    if constexpr (!kBorders) {
      if (launch.by_two && visit_pairs_of_two<kBoundary>(launch, k, touch_pair)) continue;
    }
    for (std::uint32_t of = k; of < min(k + num_together, end); ++of)
      visit_pairs<kBorders, kBoundary>(launch, of, touch_pair);
  }
}

// Returns whether what lists have no room for is in the pool.
template <bool kBorders>
__device__ bool has_pool(const StepLaunch& launch) {
  return !kBorders && *launch.contacts.num_pooled <= launch.contacts.max_pooled;
}

// Blocks of contact_kernel before those of the lists: one that moves the ball, then some for the pool.
template <bool kBorders>
PF_HD unsigned num_blocks_for_ball(const StepLaunch& launch) {
  return !kBorders && contacts_move_ball(launch) ? 1 : 0;
}
template <bool kBorders>
PF_HD unsigned num_blocks_for_pool(const StepLaunch& launch) {
  constexpr unsigned kMost = 64;
  const unsigned wanted = launch.contacts.max_pooled / kContactBlock + 1;
  return kBorders ? 0 : (wanted < kMost ? wanted : kMost);
}

// block: of those for the pool. Not inlined, likewise.
template <class Contact, Boundary kBoundary>
__device__ __noinline__ void touch_pooled(const StepLaunch& launch, unsigned block, DeviceTally& tally) {
  const ContactScratch& contacts = launch.contacts;
  const std::uint32_t num = has_pool<false>(launch) ? *contacts.num_pooled : 0;
  const unsigned num_threads = num_blocks_for_pool<false>(launch) * kContactBlock;
  for (std::uint32_t k = block * kContactBlock + threadIdx.x; k < num; k += num_threads)
    touch<Contact, false, kBoundary>(launch, contacts.pooled_first[k], contacts.pooled_second[k], tally);
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
  const bool is_any_long = __any_sync(kWarp, num > min(size, kThreadsOfList));
  unsigned crowded = 0;
  if (is_any_long && __any_sync(kWarp, num > size)) {
    const bool is_pooled = has_pool<kBorders>(launch);
    crowded = __ballot_sync(kWarp, slot == 0 && num > size && !is_pooled);
    if (num > size) num = is_pooled ? size : 0;
  }
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
  const unsigned num_for_ball = num_blocks_for_ball<kBorders>(launch),
                 num_for_pool = num_blocks_for_pool<kBorders>(launch);
  if (blockIdx.x < num_for_ball) {
    if (threadIdx.x < 32) move_ball_past_step_before(launch);
    return;
  }
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  DeviceTally tally{&block_tally};
  const unsigned block = blockIdx.x - num_for_ball;
  if (!kBorders && block < num_for_pool) {
    DeviceTally of_pool{&block_tally};
    touch_pooled<Contact, kBoundary>(launch, block, of_pool);
    tally = of_pool;
  } else {
    const unsigned of_lists = block - num_for_pool;
    const std::uint32_t list = (of_lists * kContactBlock + threadIdx.x) / 32 * kListsOfWarp;
    if (list < num_lists) touch_listed<Contact, kBorders, kBoundary>(launch, list, num_lists, tally);
  }
  __syncwarp();
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
  launch_find_pairs(launch, kBorders, stream);
  if (launch.sort.is_due) {
    const std::uint32_t num_words = blocks_for(num, 32);
    launch_in_turn(clear_few_kernel, blocks_for(num_words, kContactBlock), kContactBlock, stream,
                   launch.contacts, num_words);
  }
  launch_in_turn(contact_kernel<Contact, kBorders, kBoundary>,
                 num_blocks_for_ball<kBorders>(launch) + num_blocks_for_pool<kBorders>(launch) +
                     blocks_for(num_lists, kContactBlock / 32 * kListsOfWarp),
                 kContactBlock, stream, launch, num_lists);
}

template <bool kBorders>
void launch_for(StepLaunch launch, cudaStream_t stream) {
  const Physics& physics = launch.constants.physics;
  if (!physics.parcels.contacts) return;
  launch.by_two = !kBorders && searches_by_two(physics, launch.num);
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
