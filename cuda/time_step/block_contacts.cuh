// The contacts of the parcels of a block, one or two of each thread, worked off together: few threads have
// any. A pair of two of its parcels is found and computed once.
#pragma once

#include "cuda/time_step/pairs.cuh"

namespace pf {

// A block's pairs, and the sums of its parcels, in shared memory.
template <class Contact, unsigned kPerThread>
struct alignas(16) BlockContacts {
  static constexpr unsigned kParcels = kSharingBlock * kPerThread, kMaxPairs = 4 * kParcels;
  static constexpr unsigned kWords = Contact::kPushes ? 9 : 4;

  // By word: low and high ones of the sums of ContactSums, and the number of contacts. A thread's parcels
  // follow each other.
  std::uint32_t sums[kWords][kParcels];
  // The parcel of the block, 0 to kParcels - 1, in the lowest bits, and how far ahead of the block's first
  // one its partner is in the others. Negative if it comes before.
  std::int32_t pairs[kMaxPairs];
  std::uint32_t num_pairs;  // found, also if there are more than kMaxPairs
  // A bit for each thread: all pairs that it has found are among them.
  std::uint32_t listed[kSharingBlock / 32];
  // Index of the block's first parcel. In shared memory, since a register for it would be spilled, to the
  // cache that all multiprocessors share.
  std::uint32_t first;

  static constexpr unsigned kOwnBits = kPerThread == 2 ? 8 : 7;
  static_assert(kParcels == 1U << kOwnBits);
  // Returns whether a pair can hold it.
  static __device__ __forceinline__ bool is_in_range(std::uint32_t ahead) {
    constexpr std::uint32_t kRange = 1U << (32 - kOwnBits);
    return ahead + kRange / 2 < kRange;
  }

  __device__ __forceinline__ unsigned num_listed() const { return min(num_pairs, kMaxPairs); }
  __device__ __forceinline__ bool are_listed(unsigned thread) const {
    return (listed[thread / 32] >> thread % 32 & 1U) != 0;
  }

  // A barrier of the block has to follow.
  __device__ __forceinline__ void begin(std::uint32_t first_of_block) {
#pragma unroll
    for (unsigned w = 0; w < kWords; ++w) {
#pragma unroll
      for (unsigned n = 0; n < kPerThread; ++n) sums[w][threadIdx.x * kPerThread + n] = 0;
    }
    if (threadIdx.x == 0) {
      num_pairs = 0;
      first = first_of_block;
    }
  }

  // of: parcel of the block. Other threads may add to the same one.
  __device__ __forceinline__ void add(unsigned of, const ContactSums& added) {
    add_wide(0, of, added.velocity_x);
    add_wide(2, of, added.velocity_y);
    if constexpr (Contact::kPushes) {
      add_wide(4, of, added.push_x);
      add_wide(6, of, added.push_y);
      atomicAdd(&sums[8][of], std::uint32_t{added.num_contacts});
    }
  }

  // The sums of the n-th parcel of the thread.
  __device__ __forceinline__ ContactSums sums_of(unsigned n) const {
    ContactSums of_parcel;
    of_parcel.velocity_x = wide(0, n);
    of_parcel.velocity_y = wide(2, n);
    if constexpr (Contact::kPushes) {
      of_parcel.push_x = wide(4, n);
      of_parcel.push_y = wide(6, n);
      of_parcel.num_contacts = static_cast<std::uint8_t>(word(8, n));
    }
    return of_parcel;
  }

 private:
  // To words w and w + 1. An atomic of 64 bits in shared memory would be a loop.
  __device__ __forceinline__ void add_wide(unsigned w, unsigned of, std::int64_t value) {
    const auto bits = static_cast<std::uint64_t>(value);
    const auto low = static_cast<std::uint32_t>(bits);
    const std::uint32_t before = atomicAdd(&sums[w][of], low);
    const std::uint32_t carry = before + low < low ? 1 : 0;
    atomicAdd(&sums[w + 1][of], static_cast<std::uint32_t>(bits >> 32) + carry);
  }

  __device__ __forceinline__ std::uint32_t word(unsigned w, unsigned n) const {
    return sums[w][threadIdx.x * kPerThread + n];
  }
  __device__ __forceinline__ std::int64_t wide(unsigned w, unsigned n) const {
    return static_cast<std::int64_t>(std::uint64_t{word(w + 1, n)} << 32 | word(w, n));
  }
};

// The same for parcel i, seen from it alone.
template <class Contact, unsigned kPerThread, Boundary kBoundary>
__device__ __noinline__ void touch_from_one_side(const StepLaunch& launch, std::uint32_t i, std::uint32_t j,
                                                 unsigned of, BlockContacts<Contact, kPerThread>& block,
                                                 DeviceTally& tally) {
  ContactSums sums;
  touch_from<Contact, kBoundary>(launch, parcel_at(launch, i), j, sums, tally);
  block.add(of, sums);
}

// Adds a contact to the sums of the block's parcels, if they touch. first: index of the block's first parcel;
// own, ahead: as in BlockContacts::pairs.
template <class Contact, unsigned kPerThread, Boundary kBoundary>
__device__ __forceinline__ void touch_of_block(const StepLaunch& launch, std::uint32_t first, unsigned own,
                                               std::uint32_t ahead, BlockContacts<Contact, kPerThread>& block,
                                               DeviceTally& tally) {
  const std::uint32_t i = first + own, j = first + ahead;
  const bool are_both = ahead < BlockContacts<Contact, kPerThread>::kParcels;
  Parcel one = motion_at(launch.from, i), two = motion_at(launch.from, j);
  // Of both ids matter for coincident centres only, and to tally the pair once.
  one.id = are_both ? 0 : launch.from.id[i];
  two.id = are_both ? 1 : launch.from.id[j];
  if constexpr (Contact::kPushes) two.is_heated = is_heated(launch.from, i) | is_heated(launch.from, j);
  const World& world = launch.constants.physics.world;
  const Vec2i offset = separation<kBoundary>(world, one.position, two.position);
  if (are_both && !is_same_from_both<kBoundary>(world, offset)) {
    DeviceTally of_pair = tally;  // a copy, since what is passed by reference cannot stay in registers
    touch_from_one_side<Contact, kPerThread, kBoundary>(launch, i, j, own, block, of_pair);
    touch_from_one_side<Contact, kPerThread, kBoundary>(launch, j, i, ahead, block, of_pair);
    tally = of_pair;
  } else {
    ContactSums sums;
    add_contact<Contact>(launch.constants, one, two, offset, sums, tally);
    block.add(own, sums);
    if (are_both) block.add(ahead, -sums);
  }
}

// Returns whether a pair is the first parcel's to find. Parcels of one block find those that come later.
template <class Contact, unsigned kPerThread>
__device__ __forceinline__ bool finds(unsigned own, std::uint32_t ahead) {
  return ahead >= BlockContacts<Contact, kPerThread>::kParcels || ahead > own;
}

// The pairs of a thread's parcels, which are not listed. Not inlined: the kernel would need more
// registers for what is rare.
template <class Contact, unsigned kPerThread, Boundary kBoundary>
__device__ __noinline__ void touch_one_by_one(const StepLaunch& launch, std::uint32_t first,
                                              std::int32_t reach, BlockContacts<Contact, kPerThread>& block,
                                              DeviceTally& tally) {
  const unsigned own_first = threadIdx.x * kPerThread;
  for (unsigned own = own_first; own < own_first + kPerThread && first + own < launch.num; ++own) {
    const Vec2i position = launch.from.position[first + own];
    if (is_retired(position)) continue;
    const SearchCircle circle{position, first + own, reach, launch.constants.filter_distance2};
    search<kBoundary, true>(launch.space, launch.from.position, circle, [&](std::uint32_t j) {
      const std::uint32_t ahead = j - first;
      if (finds<Contact, kPerThread>(own, ahead))
        touch_of_block<Contact, kPerThread, kBoundary>(launch, first, own, ahead, block, tally);
    });
  }
}

// Sums the contacts of the block's parcels, from `first` on. Whole blocks call it after block.begin() and a
// barrier, and have the sums then. reach: in shared memory.
template <class Contact, unsigned kPerThread, Boundary kBoundary>
__device__ __forceinline__ void sum_contacts_of_block(const StepLaunch& launch, std::uint32_t first,
                                                      const std::int32_t& reach,
                                                      BlockContacts<Contact, kPerThread>& block,
                                                      DeviceTally& tally) {
  using Block = BlockContacts<Contact, kPerThread>;
  constexpr unsigned kAll = 0xFFFFFFFFU;
  const unsigned lane = threadIdx.x % 32, first_of_warp = threadIdx.x - lane;
  bool has_room = true;
  const std::uint32_t own_first = first + kPerThread * threadIdx.x;
  const bool are_together =
      visit_partners<kPerThread, kBoundary>(launch, own_first, reach, [&](unsigned n, std::uint32_t j) {
        const unsigned own = kPerThread * threadIdx.x + n;
        const std::uint32_t ahead = j - block.first;
        if (!finds<Contact, kPerThread>(own, ahead)) return;
        unsigned slot = Block::kMaxPairs;
        if (Block::is_in_range(ahead)) slot = atomicAdd(&block.num_pairs, 1U);
        if (slot < Block::kMaxPairs)
          block.pairs[slot] = static_cast<std::int32_t>(ahead << Block::kOwnBits | own);
        else
          has_room = false;
      });
  const bool is_listed = own_first >= launch.num || (are_together && has_room);
  const unsigned listed = __ballot_sync(kAll, is_listed);
  if (lane == 0) block.listed[threadIdx.x / 32] = listed;
  const bool all_are_listed = __syncthreads_or(is_listed ? 0 : 1) == 0;
  // A warp goes through this together: if its threads did not wait for each other it would fall apart.
  for (unsigned at = first_of_warp; at < block.num_listed(); at += kSharingBlock) {
    if (at + lane < block.num_listed()) {
      const std::int32_t pair = block.pairs[at + lane];
      const unsigned own = static_cast<unsigned>(pair) % Block::kParcels;
      const auto ahead = static_cast<std::uint32_t>(pair >> Block::kOwnBits);
      if (all_are_listed || block.are_listed(own / kPerThread))
        touch_of_block<Contact, kPerThread, kBoundary>(launch, block.first, own, ahead, block, tally);
    }
    __syncwarp();
  }
  if (!all_are_listed && !block.are_listed(threadIdx.x)) {
    DeviceTally of_thread = tally;
    touch_one_by_one<Contact, kPerThread, kBoundary>(launch, block.first, reach, block, of_thread);
    tally = of_thread;
  }
  __syncthreads();
}

}  // namespace pf
