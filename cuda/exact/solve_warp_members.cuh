// Method `exact` on the device: the members of a cluster that a warp solves, one in the registers of each
// lane.
#pragma once

#include "cuda/exact/solve_common.cuh"

namespace pf::cuda {

// All lanes call the functions of this class together, with the same arguments unless noted.
class WarpMembers {
 public:
  static constexpr unsigned kCapacity = 32;  // members

 protected:
  __device__ __forceinline__ WarpMembers(const StepContext& step, BlockCounts& counts)
      : step_(step),
        memory_(step.memory),
        c_(step.c),
        counts_(counts),
        lane_(threadIdx.x % 32),
        positions_(step.start_positions()) {}

  static constexpr unsigned kNoLane = 32;

  static __device__ __forceinline__ unsigned first_of(unsigned lanes) { return __ffs(lanes) - 1; }
  static __device__ __forceinline__ unsigned bit(unsigned lane) { return lane < 32 ? 1U << lane : 0U; }
  // The value of a lane, which each lane chooses.
  template <class T>
  static __device__ __forceinline__ T from(T value, unsigned lane) {
    return __shfl_sync(kWholeWarp, value, lane);
  }
  static __device__ __forceinline__ Vec2i from(Vec2i value, unsigned lane) {
    return {from(value.x, lane), from(value.y, lane)};
  }
  static __device__ __forceinline__ Trajectory from(const Trajectory& trajectory, unsigned lane) {
    return of_lane(trajectory, lane);
  }
  static __device__ __forceinline__ Event from(const Event& event, unsigned lane) {
    return {from(event.tick, lane), from(event.partner, lane), from(event.partner_id, lane),
            from(event.generation, lane)};
  }
  static __device__ __forceinline__ long long sum_of_lanes(long long value) {
    for (int offset = 16; offset > 0; offset /= 2) value += __shfl_xor_sync(kWholeWarp, value, offset);
    return value;
  }
  __device__ __forceinline__ bool is_member() const { return lane_ < num_; }

  // Returns whether each member gets a lane.
  template <Boundary kBoundary>
  __device__ __forceinline__ bool load_members(std::uint32_t list) {
    num_ = 0;
    for (std::uint32_t m = list; m != kInvalidIndex; m = memory_.members[m].next) {
      if (num_ == kCapacity) return false;
      if (lane_ == num_) slot_ = m;
      ++num_;
    }
    if (is_member()) {
      it_ = member_at_start<kBoundary>(step_, memory_.members[slot_].index, true);
      here_ = positions_[it_.index];
    }
    __syncwarp();
    return true;
  }

  // The lane of parcel i, which joins the cluster if it is free, without an event: it takes part in the
  // present one, and is predicted then. Otherwise kNoLane; other_ is then the cluster that owns it, or this
  // one if there is no lane left.
  __device__ __forceinline__ unsigned lane_of(std::uint32_t i) {
    const unsigned holding = __ballot_sync(kWholeWarp, is_member() && it_.index == i);
    if (holding != 0) return first_of(holding);
    if (num_ == kCapacity) {
      other_ = cluster_;
      return kNoLane;
    }
    const unsigned joining = num_;
    std::uint32_t owner = kInvalidIndex;
    if (lane_ == joining) {
      it_ = member_without_event(step_, i);
      here_ = positions_[i];
      owner = claim(step_, i, cluster_);
      if (owner == kInvalidIndex) slot_ = new_member_slot(step_, counts_, i);
    }
    owner = from(owner, joining);
    if (owner != kInvalidIndex) {
      other_ = owner;
      return kNoLane;
    }
    ++num_;
    return joining;
  }

  // Writes the members to memory as a list that continues with `rest`.
  __device__ __forceinline__ void write_members(std::uint32_t rest) {
    const std::uint32_t next = __shfl_down_sync(kWholeWarp, slot_, 1);
    if (!is_member()) return;
    it_.next = lane_ + 1 < num_ ? next : rest;
    memory_.members[slot_] = it_;
  }

  // Takes over the members of the cluster that this one conflicts with, if that was solved as a pair, as most
  // clusters are: then both are solved at once, without another round. Returns whether it did.
  __device__ __forceinline__ bool absorb(std::uint32_t& list) {
    std::uint32_t absorbed = kInvalidIndex;
    if (lane_ == 0 && other_ != cluster_) absorbed = absorb_pair(step_, other_, cluster_);
    absorbed = from(absorbed, 0);
    if (absorbed == kInvalidIndex) return false;
    write_members(absorbed);
    list = from(slot_, 0);
    __threadfence();
    __syncwarp();
    return true;
  }

  __device__ __forceinline__ void finish(std::uint32_t list, bool fits, bool solved) {
    if (fits) write_members(kInvalidIndex);
    if (__any_sync(kWholeWarp, tally_.num_hits > 0)) {
      tally_.num_hits = warp_add(tally_.num_hits);
      tally_.ball_x = sum_of_lanes(tally_.ball_x);
      tally_.ball_y = sum_of_lanes(tally_.ball_y);
      tally_.ball_torque = sum_of_lanes(tally_.ball_torque);
    }
    tally_.fastest2 = __uint_as_float(warp_max(__float_as_uint(tally_.fastest2)));
    if (lane_ == 0) {
      Cluster& cluster = cluster_of(step_, cluster_);
      cluster.members = fits ? slot_ : list;
      cluster.merged = kInvalidIndex;
      cluster.solution = solved ? kSolved : kUnsolved;
      cluster.attempt = attempt_;
      cluster.tally = tally_;
      note_solved(step_, tally_.num_events, tally_.num_events);
      if (solved) {
        if (tally_.fastest2 > 0.0F)
          atomicMax(&step_.state.fastest_after_bits, __float_as_uint(tally_.fastest2));
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
  BlockCounts& counts_;
  unsigned lane_;
  const Vec2i* positions_;  // at the step's start
  std::uint32_t cluster_ = 0;
  std::uint32_t attempt_ = 0;
  std::uint32_t other_ = kInvalidIndex;  // cluster that stopped this one
  unsigned num_ = 0;                     // members
  Member it_;                            // this lane's member
  Vec2i here_{};                         // its position at the step's start
  std::uint32_t slot_ = 0;               // its slot
  ClusterTally tally_;                   // equal in all lanes, except hits of the ball and the largest speed
};

}  // namespace pf::cuda
