// Method `exact` on the device: a block solves a cluster, as the CPU's ClusterSolver does with one thread. It
// needs less time than a warp for an event, so it solves clusters where they are few, and large ones.
#pragma once

#include "cuda/exact/solve_block_predict.cuh"

namespace pf::cuda {

// All threads of the block go through the cluster together.
template <Boundary kBoundary>
class BlockSolver : BlockPredictions<kBoundary> {
 public:
  __device__ __forceinline__ BlockSolver(const StepContext& step, BlockSpace& space, BlockCounts& counts)
      : BlockPredictions<kBoundary>(step, space, counts), max_events_(step.state.max_events) {}

  // Solves the cluster. list: slot of its first member. All threads call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    const bool fits = members_.start(cluster, list);
    bool solved = false;
    if (fits) {
      do {
        members_.template load<kBoundary>();
        solved = process_events();
        __syncthreads();
      } while (!solved && members_.absorb());
    }
    members_.finish(list, fits, solved);
    __syncthreads();
  }

 private:
  using Base = BlockPredictions<kBoundary>;
  using Base::c_, Base::kNoPlace, Base::kNumChanged, Base::members_, Base::space_, Base::step_;

  // The earliest event; its place is that of a member that has it. Each warp looks for itself where that
  // takes one look: it spares a barrier.
  __device__ __forceinline__ OrderedEvent next_event() {
    const bool are_few = members_.num() <= 32;
    OrderedEvent best;
    for (std::uint32_t k = are_few ? threadIdx.x % 32 : threadIdx.x; k < members_.num(); k += kExactBlock) {
      const Member& member = members_[k];
      const Event event = member.event;
      if (event.tick == kNoTick) continue;
      const OrderedEvent own{event.tick, event.generation, min(member.id, event.partner_id),
                             max(member.id, event.partner_id), k};
      if (comes_before(own, best)) best = own;
    }
    return are_few ? first_of_warp(best) : first_of_block(best, space_.first_of_warps);
  }

  // Applies events in their order up to the window's end. Returns false if another cluster owns a partner.
  // Everything is inlined once into this loop, so that the kernel's argument stays in the constant bank.
  __device__ __forceinline__ bool process_events() {
    while (true) {
      const OrderedEvent next = next_event();
      if (next.tick == kNoTick) return true;
      if (members_.tally.num_events == max_events_) {
        if (members_.leads()) stop_at(step_, next.tick);
        return true;
      }
      const Event event = members_[next.place].event;
      std::uint32_t other = flag_members(next.place, event);
      if (other == kInvalidIndex && is_parcel(event.partner)) {
        other = members_.join(event.partner);
        if (other == kInvalidIndex) return false;
      }
      if (threadIdx.x < 32) apply_event(event, next.place, other);
      record(next, other);
      __syncthreads();
      this->predict_flagged();
    }
  }

  // Finds the place of an event's partner; kInvalidIndex if it is no member. Flags the members whose own
  // events the event undoes.
  __device__ __forceinline__ std::uint32_t flag_members(std::uint32_t own, const Event& event) {
    const bool with_parcel = is_parcel(event.partner);
    const std::uint32_t index = members_[own].index;
    for (std::uint32_t k = threadIdx.x; k < members_.num(); k += kExactBlock) {
      const Member& member = members_[k];
      const std::uint32_t partner = member.event.partner;
      if (k == own) continue;
      if (with_parcel && member.index == event.partner) {
        space_.partner = k;
      } else if (partner == index || (with_parcel && partner == event.partner)) {
        space_.flagged[atomicAdd(&space_.num_flagged, 1U)] = static_cast<std::uint16_t>(k);
      }
    }
    __syncthreads();
    return space_.partner;
  }

  // Called by all threads, so that num_events is equal in all.
  __device__ __forceinline__ void record(const OrderedEvent& event, std::uint32_t other) {
    ++members_.tally.num_events;
    if (threadIdx.x != kExactBlock - 1) return;
    space_.flagged[0] = static_cast<std::uint16_t>(event.place);
    space_.flagged[1] = other != kInvalidIndex ? static_cast<std::uint16_t>(other) : kNoPlace;
    space_.event_hash += event_hash(step_.since_reset(event.tick), event.low_id, event.high_id);
  }

  // Applies the event of member `own`; other: its partner, or kInvalidIndex. Called by the first warp: its
  // first lane has the parcel with the lower id, the others the other one.
  __device__ __forceinline__ void apply_event(const Event& event, std::uint32_t own, std::uint32_t other) {
    const bool with_parcel = other != kInvalidIndex;
    const bool swap = with_parcel && members_[other].id < members_[own].id;
    const bool is_first = threadIdx.x == 0 || !with_parcel;
    Member& member = members_[is_first == swap ? other : own];
    Trajectory now = member.trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    ClusterTally& tally = members_.tally;
    if (with_parcel) {
      const bool recent = is_in_contact(c_.plan, event.tick, member.last_contact_tick);
      Trajectory first = of_lane(now, 0), second = of_lane(now, 1);
      collide<kBoundary>(c_, first, second, __any_sync(kWholeWarp, recent) != 0, tally);
      now = is_first ? first : second;
    } else if (threadIdx.x == 0) {
      if (event.partner == kBallPartner) {
        hit_ball<kBoundary>(step_, member,
                            {event.tick, member.id, members_.cluster, members_.attempt, member.trajectory,
                             member.next_generation},
                            now, tally);
      } else {
        apply_edge(c_, event.partner, now);
      }
      if (event.partner == kExit) tally.retired();
    }
    __syncwarp();
    if (threadIdx.x >= (with_parcel ? 2U : 1U)) return;
    set_trajectory(step_, members_.counts, now, event, member, tally);
    if (event.partner == kBallPartner)
      member.has_changed = kHitBall;
    else
      member.last_contact_tick = c_.plan.start + event.tick;
  }

  std::uint32_t max_events_;
};

}  // namespace pf::cuda
