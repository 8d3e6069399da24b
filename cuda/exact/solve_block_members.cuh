// Method `exact` on the device: the members of a cluster that the threads of a block solve together.
#pragma once

#include "cuda/exact/clusters.cuh"

namespace pf {

// What the block's threads share.
struct BlockSpace {
  static constexpr unsigned kCapacity = 3072;
  std::uint32_t table[kCapacity];    // places of the members
  std::uint32_t flagged[kCapacity];  // members to predict again
  std::uint32_t num_members, num_flagged, other, joined;
  uint4 of_warps[kExactBlock / 32];
};

// A cluster's members, in the hands of a block: all threads call these together, the first one writes.
template <Boundary kBoundary>
class BlockMembers {
 public:
  static constexpr unsigned kCapacity = BlockSpace::kCapacity;

 protected:
  __device__ __forceinline__ BlockMembers(const ExactLaunch& launch, const ExactConstants& c,
                                          ExactState& state, BlockSpace& space, BlockCounts& counts)
      : launch_(launch),
        a_(launch.arrays),
        c_(c),
        state_(state),
        space_(space),
        counts_(counts),
        table_(space.table),
        flagged_(space.flagged),
        present_(launch.arrays.present[state.current_buffer]) {}

  __device__ __forceinline__ bool leads() const { return threadIdx.x == 0; }
  __device__ __forceinline__ void sync() const { __syncthreads(); }
  __device__ __forceinline__ std::uint32_t id(std::uint32_t parcel) const { return a_.trajectories.id[parcel]; }
  __device__ __forceinline__ ClusterMember& member(std::uint32_t m) const { return a_.members[m]; }
  __device__ __forceinline__ std::uint32_t owner_of(std::uint32_t i) const {
    return load_fresh(&a_.owner[i]);
  }
  __device__ __forceinline__ std::uint32_t num_members() const { return space_.num_members; }

  static __device__ __forceinline__ bool is_before(const uint4& p, const uint4& q) {
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    return p.z != q.z ? p.z < q.z : p.w < q.w;
  }
  // The least of the threads' keys, the same in all of them: two members may have one and the same event.
  __device__ __forceinline__ uint4 least(uint4 best) {
    for (unsigned offset = 16; offset > 0; offset /= 2) {
      const uint4 other{
          __shfl_xor_sync(kWholeWarp, best.x, offset), __shfl_xor_sync(kWholeWarp, best.y, offset),
          __shfl_xor_sync(kWholeWarp, best.z, offset), __shfl_xor_sync(kWholeWarp, best.w, offset)};
      if (is_before(other, best)) best = other;
    }
    if (threadIdx.x % 32 == 0) space_.of_warps[threadIdx.x / 32] = best;
    __syncthreads();
    for (const uint4& other : space_.of_warps) {
      if (is_before(other, best)) best = other;
    }
    __syncthreads();
    return best;
  }
  __device__ __forceinline__ Event earliest(const Event& best) {
    const uint4 min_of_all = least({best.tick, best.partner_id, 0U, best.partner});
    return {min_of_all.x, min_of_all.w, min_of_all.y};
  }

  // ---- members

  // Whether they are as few as there is room for.
  __device__ __forceinline__ bool load_members(std::uint32_t list) {
    if (leads()) {
      std::uint32_t num = 0;
      for (std::uint32_t m = list; m != kInvalidIndex && num < kCapacity + 1; m = member(m).next) {
        if (num < kCapacity) table_[num] = m;
        ++num;
      }
      space_.num_members = num;
    }
    sync();
    if (num_members() > kCapacity) return false;
    for (std::uint32_t k = threadIdx.x; k < num_members(); k += kExactBlock)
      member(table_[k]) = member_at_start(a_, member(table_[k]).index);
    sync();
    return true;
  }

  // The parcel's place among the members, which it joins if it is nobody's; else kNone, and space_.other has
  // the cluster whose it is, or this one's own name if there is no room.
  __device__ __forceinline__ std::uint32_t join(std::uint32_t i) {
    if (leads()) {
      std::uint32_t place = kInvalidIndex;
      if (owner_of(i) == cluster_) {
        place = a_.member_slot[i];
      } else if (num_members() == kCapacity) {
        space_.other = cluster_;
      } else {
        const std::uint32_t owner = atomicCAS(&a_.owner[i], kInvalidIndex, cluster_);
        __threadfence();  // of two clusters that take a parcel each and then look at the other's, one sees it
        if (owner != kInvalidIndex) {
          space_.other = owner;
        } else {
          place = atomicAdd(&counts_.members, 1U);
          if (place >= a_.member_capacity) {
            state_.solve_failed = 1;
            place = 0;
          }
          place += blockIdx.x * a_.member_capacity;
          a_.member_slot[i] = place;
          member(place) = member_at_start(a_, i);
          table_[space_.num_members++] = place;
        }
      }
      space_.joined = place;
    }
    sync();
    const std::uint32_t place = space_.joined;
    sync();
    return place;
  }

  // Called by the first thread: the list of members, and what came of it, for the other blocks.
  __device__ __forceinline__ void finish(std::uint32_t list, bool fits, bool solved) {
    ClusterRecord& record = record_of(a_, cluster_);
    const std::uint32_t num = fits ? num_members() : 0U;
    for (std::uint32_t k = 0; k < num; ++k) member(table_[k]).next = k + 1 < num ? table_[k + 1] : kInvalidIndex;
    record.members = fits ? (num > 0 ? table_[0] : kInvalidIndex) : list;
    record.merged = kInvalidIndex;
    record.is_solved = solved ? kSolved : 0U;
    record.sum = sum_;
    if (solved) {
      if (sum_.fastest2 > 0.0F) atomicMax(&state_.fastest_after_bits, __float_as_uint(sum_.fastest2));
      return;
    }
    const std::uint32_t other = fits ? space_.other : cluster_;
    if (other == cluster_) {  // no room: a block is to solve it
      record.wants_block = 1;
      state_.solve_failed = 1;
    }
    add_conflict(a_, counts_, state_, cluster_, other);
  }

  const ExactLaunch& launch_;
  const ExactArrays& a_;
  const ExactConstants& c_;
  ExactState& state_;
  BlockSpace& space_;
  BlockCounts& counts_;
  std::uint32_t* table_;
  std::uint32_t* flagged_;
  const Vec2i* present_;
  std::uint32_t cluster_ = 0;
  bool has_ball_ = false;
  EventSums sum_;
};

}  // namespace pf
