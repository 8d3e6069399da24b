// Method `exact` on the device: the members of a cluster that the threads of a block solve together.
#pragma once

#include "cuda/exact/event_order.cuh"
#include "cuda/exact/solve_common.cuh"

namespace pf::cuda {

// Shared memory of the block.
struct BlockSpace {
  static constexpr unsigned kCapacity = 3072;
  std::uint32_t table[kCapacity];    // slots of the members
  std::uint32_t flagged[kCapacity];  // slots of members to predict
  std::uint32_t num_members, num_flagged;
  std::uint32_t other;   // cluster that stopped this one
  std::uint32_t joined;  // slot of the parcel that joined last, or kInvalidIndex
  OrderedEvent first_of_warps[kExactBlock / 32];
};

// All threads of the block call the functions of this struct together, unless noted; the first one writes.
struct BlockMembers {
  static constexpr unsigned kCapacity = BlockSpace::kCapacity;

  const StepContext& step;
  const StepMemory& memory;
  BlockCounts& counts;
  BlockSpace& space;
  std::uint32_t cluster = 0;
  ClusterTally tally;

  __device__ __forceinline__ bool leads() const { return threadIdx.x == 0; }
  __device__ __forceinline__ std::uint32_t num() const { return space.num_members; }
  __device__ __forceinline__ Member& operator[](std::uint32_t slot) const { return memory.members[slot]; }

  __device__ __forceinline__ void start(std::uint32_t name) {
    cluster = name;
    tally = {};
    if (leads()) {
      space.num_members = 0;
      space.num_flagged = 0;
      space.other = kInvalidIndex;
    }
    __syncthreads();
  }

  // Loads the members of a list of slots, at the step's start. Returns whether there is room for all.
  template <Boundary kBoundary>
  __device__ __forceinline__ bool load(std::uint32_t list) {
    if (leads()) {
      std::uint32_t num_listed = 0;
      for (std::uint32_t m = list; m != kInvalidIndex && num_listed < kCapacity + 1; m = (*this)[m].next) {
        if (num_listed < kCapacity) space.table[num_listed] = m;
        ++num_listed;
      }
      space.num_members = num_listed;
    }
    __syncthreads();
    if (num() > kCapacity) return false;
    for (std::uint32_t k = threadIdx.x; k < num(); k += kExactBlock) {
      Member& member = (*this)[space.table[k]];
      member = member_at_start<kBoundary>(step, member.index);
    }
    __syncthreads();
    return true;
  }

  // The slot of parcel i, which joins the cluster if it is free. Otherwise kInvalidIndex; space.other is then
  // the cluster that owns it, or this one if there is no room.
  template <Boundary kBoundary>
  __device__ __forceinline__ std::uint32_t join(std::uint32_t i) {
    if (leads()) space.joined = find_or_add<kBoundary>(i);
    __syncthreads();
    const std::uint32_t slot = space.joined;
    __syncthreads();
    return slot;
  }

  // Called by the first thread.
  template <Boundary kBoundary>
  __device__ __forceinline__ std::uint32_t find_or_add(std::uint32_t i) {
    if (step.owner_of(i) == cluster) return memory.member_slot[i];
    if (num() == kCapacity) {
      space.other = cluster;
      return kInvalidIndex;
    }
    const std::uint32_t owner = claim(step, i, cluster);
    if (owner != kInvalidIndex) {
      space.other = owner;
      return kInvalidIndex;
    }
    const std::uint32_t slot = new_member_slot(step, counts, i);
    (*this)[slot] = member_at_start<kBoundary>(step, i);
    space.table[space.num_members++] = slot;
    return slot;
  }

  __device__ __forceinline__ OrderedEvent first_of_block(const OrderedEvent& event) {
    return cuda::first_of_block(event, space.first_of_warps);
  }
  __device__ __forceinline__ Event earliest(const Event& best) {
    const OrderedEvent first =
        first_of_block({best.tick, best.generation, best.partner_id, best.partner_id, best.partner});
    return {first.tick, first.place, first.low_id, first.generation};
  }

  // Called by the first thread: stores the list of members and the outcome for the other blocks.
  // list: that the cluster was started with.
  __device__ __forceinline__ void finish(std::uint32_t list, bool fits, bool solved) {
    Cluster& record = cluster_of(step, cluster);
    const std::uint32_t num_stored = fits ? num() : 0U;
    for (std::uint32_t k = 0; k < num_stored; ++k)
      (*this)[space.table[k]].next = k + 1 < num_stored ? space.table[k + 1] : kInvalidIndex;
    record.members = fits ? (num_stored > 0 ? space.table[0] : kInvalidIndex) : list;
    record.merged = kInvalidIndex;
    record.solution = solved ? kSolved : kUnsolved;
    record.attempt = counts.round * kMaxAttemptsInRound;
    record.tally = tally;
    note_solved(step, tally.num_events);
    if (solved) {
      if (tally.fastest2 > 0.0F) atomicMax(&step.state.fastest_after_bits, __float_as_uint(tally.fastest2));
      return;
    }
    const std::uint32_t other = fits ? space.other : cluster;
    if (other == cluster) {  // too many members, even for a block
      record.needs_block = 1;
      step.state.solve_failed = 1;
    }
    add_conflict(step, counts, cluster, other);
  }
};

}  // namespace pf::cuda
