// Method `exact` on the device: the members of a cluster that a warp solves, one for each lane. They lie in
// shared memory: registers decide how many warps a multiprocessor holds.
#pragma once

#include "cuda/exact/solve_common.cuh"

namespace pf::cuda {

// A member as its lane has it.
struct WarpMember {
  Member it;
  Vec2i here;          // its position at the step's start
  std::uint32_t slot;  // its slot
};

// Shared memory of a block's warps.
struct WarpSpace {
  static constexpr unsigned kWarps = kExactBlock / 32;
  static constexpr unsigned kMaxNear = 48;
  WarpMember members[kWarps][32];
  ClusterTally tally[kWarps];                // of the cluster in hand
  std::uint32_t near[2 * kWarps][kMaxNear];  // parcels that a half of a warp has found
};

// All lanes call the functions of this class together, with the same arguments unless noted.
class WarpMembers {
 public:
  static constexpr unsigned kCapacity = 32;  // members

 protected:
  __device__ __forceinline__ WarpMembers(const StepContext& step, WarpSpace& space, SliceCounts& counts)
      : step_(step),
        memory_(step.memory),
        c_(step.c),
        counts_(counts),
        lane_(threadIdx.x % 32),
        positions_(step.start_positions()),
        members_(space.members[threadIdx.x / 32]),
        mine_(members_[lane_]),
        tally_(space.tally[threadIdx.x / 32]) {}

  static constexpr unsigned kNoLane = 32;

  static __device__ __forceinline__ unsigned first_of(unsigned lanes) { return __ffs(lanes) - 1; }
  static __device__ __forceinline__ unsigned bit(unsigned lane) { return lane < 32 ? 1U << lane : 0U; }
  // The value of a lane, which each lane chooses.
  template <class T>
  static __device__ __forceinline__ T from(T value, unsigned lane) {
    return __shfl_sync(kWholeWarp, value, lane);
  }
  static __device__ __forceinline__ Trajectory from(const Trajectory& trajectory, unsigned lane) {
    return of_lane(trajectory, lane);
  }
  static __device__ __forceinline__ Event from(const Event& event, unsigned lane) {
    return {from(event.tick, lane), from(event.partner, lane), from(event.partner_id, lane),
            from(event.generation, lane)};
  }
  __device__ __forceinline__ bool is_member() const { return lane_ < num_; }

  // Returns whether each member gets a lane.
  template <Boundary kBoundary>
  __device__ __forceinline__ bool load_members(std::uint32_t list) {
    num_ = 0;
    for (std::uint32_t m = list; m != kInvalidIndex; m = memory_.members[m].next) {
      if (num_ == kCapacity) return false;
      if (lane_ == num_) mine_.slot = m;
      ++num_;
    }
    if (is_member()) {
      mine_.it = member_at_start<kBoundary>(step_, memory_.members[mine_.slot].index, true);
      mine_.here = positions_[mine_.it.index];
    }
    __syncwarp();
    return true;
  }

  // The lane of parcel i, which joins the cluster if it is free, without an event: it takes part in the
  // present one, and is predicted then. Otherwise kNoLane; other_ is then the cluster that owns it, or this
  // one if there is no lane left.
  __device__ __forceinline__ unsigned lane_of(std::uint32_t i) {
    const unsigned holding = __ballot_sync(kWholeWarp, is_member() && mine_.it.index == i);
    if (holding != 0) return first_of(holding);
    if (num_ == kCapacity) {
      other_ = cluster_;
      return kNoLane;
    }
    const unsigned joining = num_;
    std::uint32_t owner = kInvalidIndex;
    if (lane_ == joining) {
      mine_.it = member_without_event(step_, i);
      mine_.here = positions_[i];
      owner = claim(step_, i, cluster_);
      if (owner == kInvalidIndex) mine_.slot = new_member_slot(step_, counts_, i);
    }
    owner = from(owner, joining);
    __syncwarp();
    if (owner != kInvalidIndex) {
      other_ = owner;
      return kNoLane;
    }
    ++num_;
    return joining;
  }

  // Writes the members to memory as a list that continues with `rest`.
  __device__ __forceinline__ void write_members(std::uint32_t rest) {
    if (!is_member()) return;
    mine_.it.next = lane_ + 1 < num_ ? members_[lane_ + 1].slot : rest;
    memory_.members[mine_.slot] = mine_.it;
  }

  // Takes over the members of the cluster that this one conflicts with, if that was solved as a pair, as most
  // clusters are: then both are solved at once, without another round. Returns whether it did.
  __device__ __forceinline__ bool absorb(std::uint32_t& list) {
    std::uint32_t absorbed = kInvalidIndex;
    if (lane_ == 0 && other_ != cluster_) absorbed = absorb_pair(step_, other_, cluster_);
    absorbed = from(absorbed, 0);
    if (absorbed == kInvalidIndex) return false;
    write_members(absorbed);
    list = members_[0].slot;
    __threadfence();
    __syncwarp();
    return true;
  }

  __device__ __forceinline__ void finish(std::uint32_t list, bool fits, bool solved) {
    if (fits) write_members(kInvalidIndex);
    const std::uint32_t fastest2_bits = warp_max(__float_as_uint(fastest2_));
    if (lane_ == 0) {
      tally_.fastest2 = __uint_as_float(fastest2_bits);
      Cluster& cluster = cluster_of(step_, cluster_);
      cluster.members = fits ? mine_.slot : list;
      cluster.merged = kInvalidIndex;
      cluster.solution = solved ? kSolved : kUnsolved;
      cluster.attempt = attempt_;
      cluster.tally = tally_;
      note_solved(step_, tally_.num_events, tally_.num_events);
      if (solved) {
        if (fastest2_bits != 0) atomicMax(&step_.state.fastest_after_bits, fastest2_bits);
      } else {
        if (other_ == cluster_) cluster.needs_block = 1;
        add_conflict(step_, counts_, cluster_, other_);
      }
    }
    __syncwarp();
  }

  const StepContext& step_;
  const StepMemory& memory_;
  const ExactConstants& c_;
  SliceCounts& counts_;
  unsigned lane_;
  const Vec2i* positions_;  // at the step's start
  std::uint32_t cluster_ = 0;
  std::uint32_t attempt_ = 0;
  std::uint32_t other_ = kInvalidIndex;  // cluster that stopped this one
  unsigned num_ = 0;                     // members
  float fastest2_ = 0.0F;                // as ClusterTally::fastest2, of this lane's member
  WarpMember (&members_)[32];
  WarpMember& mine_;     // this lane's
  ClusterTally& tally_;  // the lane of an event's member adds to it
};

}  // namespace pf::cuda
