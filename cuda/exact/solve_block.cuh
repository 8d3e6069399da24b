// Method `exact` on the device: a block solves a cluster, as the CPU's ClusterSolver does with one thread. It
// needs less time than a warp for an event, so it solves clusters where they are few, and large ones.
#pragma once

#include "cuda/exact/solve_block_few.cuh"

namespace pf::cuda {

// All threads of the block go through the cluster together.
// kHasBall: the ball is a member.
template <Boundary kBoundary, bool kHasBall>
class BlockSolver : BlockFewMembers<kBoundary, kHasBall> {
 public:
  __device__ __forceinline__ BlockSolver(const StepContext& step, BlockSpace& space, SliceCounts& counts)
      : Base(step, space, counts) {}

  // Solves the cluster. list: slot of its first member. Returns true instead if the ball has joined the
  // cluster; list is then that of all present members. All threads call it with the same arguments.
  __device__ __forceinline__ bool solve(std::uint32_t cluster, std::uint32_t& list) {
    const bool fits = members_.start(
        cluster, list, kHasBall && members_.counts.round == 0 && step_.state.num_ball_hits != 0);
    bool solved = false;
    if (fits) {
      do {
        members_.template load<kBoundary>(kHasBall);
        if constexpr (kHasBall) ball_.load(members_.cluster);
        if (members_.leads()) space_.flagged[0] = space_.flagged[1] = kNoPlace;
        this->list_members();
        __syncthreads();
        solved = process_events();
        __syncthreads();
      } while (!solved && members_.absorb());
    }
    if (!kHasBall && !solved && fits && space_.ball_joins != 0) {
      members_.store(members_.num());
      list = space_.table[0];
      __syncthreads();
      return true;
    }
    members_.finish(list, fits, solved);
    if constexpr (kHasBall) {
      if (members_.leads()) cluster_of(step_, cluster).needs_block = 1;
      if (solved && members_.leads()) ball_.finish();
    }
    __syncthreads();
    return false;
  }

 private:
  using Base = BlockFewMembers<kBoundary, kHasBall>;
  using Base::ball_, Base::c_, Base::kBallPlace, Base::kNoPlace, Base::members_, Base::space_, Base::step_;
  using typename Base::Progress;

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
    best = are_few ? first_of_warp(best) : first_of_block(best, space_.first_of_warps);
    if constexpr (!kHasBall) return best;
    const Event of_ball = space_.ball.event;
    const OrderedEvent other{of_ball.tick, of_ball.generation, of_ball.partner_id, kBallPartner, kBallPlace};
    return of_ball.tick != kNoTick && comes_before(other, best) ? other : best;
  }

  // Applies events in their order up to the window's end. Returns false if another cluster owns a partner.
  // Everything is inlined once, so that the kernel's argument stays in the constant bank.
  __device__ __forceinline__ bool process_events() {
    if (members_.num() <= Base::kMaxMembers) {
      const Progress progress = this->process_few();
      if (progress != Progress::needs_memory) return progress == Progress::solved;
    }
    while (true) {
      __syncthreads();
      this->predict_flagged();
      const OrderedEvent next = next_event();
      if (next.tick == kNoTick || this->is_stopped(next)) return true;
      if (!process(next)) return false;
    }
  }

  // Applies an event. Returns false if another cluster owns its partner.
  __device__ __forceinline__ bool process(const OrderedEvent& next) {
    const bool of_ball = kHasBall && next.place == kBallPlace;
    Event event = of_ball ? space_.ball.event : members_[next.place].event;
    if (!kHasBall && event.partner == kBallPartner && ball_joins(step_)) {
      if (members_.leads()) this->join_ball();
      return false;
    }
    std::uint32_t own = of_ball ? kInvalidIndex : next.place;
    std::uint32_t other = flag_members(own, event);
    if (other == kInvalidIndex && is_parcel(event.partner)) {
      if constexpr (kHasBall) ball_.forget(event.partner);
      other = members_.join(event.partner);
      if (other == kInvalidIndex) return false;
    }
    if (of_ball) {
      own = other;
      other = kInvalidIndex;
      if (is_parcel(event.partner)) event.partner = kBallPartner;
    }
    if (threadIdx.x < 32) apply_event(event, own, other);
    record(next, own, other);
    return true;
  }

  // Finds the place of an event's partner; kInvalidIndex if it is no member. Flags the members whose own
  // events the event undoes. own: kInvalidIndex if it is one of the ball.
  __device__ __forceinline__ std::uint32_t flag_members(std::uint32_t own, const Event& event) {
    const bool with_parcel = is_parcel(event.partner);
    const std::uint32_t index = own != kInvalidIndex ? members_[own].index : kBallPartner;
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
  __device__ __forceinline__ void record(const OrderedEvent& event, std::uint32_t own, std::uint32_t other) {
    ++members_.tally.num_events;
    if (threadIdx.x != kExactBlock - 1) return;
    space_.flagged[0] = own != kInvalidIndex ? static_cast<std::uint16_t>(own) : kNoPlace;
    space_.flagged[1] = other != kInvalidIndex ? static_cast<std::uint16_t>(other) : kNoPlace;
    space_.event_hash += event_hash(step_.since_reset(event.tick), event.low_id, event.high_id);
  }

  // Applies the event of member `own`, or of the ball and a wall; other: its partner, or kInvalidIndex.
  // Called by the first warp: its first lane has the parcel with the lower id, the others the other one.
  __device__ __forceinline__ void apply_event(const Event& event, std::uint32_t own, std::uint32_t other) {
    if (kHasBall && own == kInvalidIndex) {
      if (threadIdx.x == 0) ball_.apply(event, event.partner, {});
      return;
    }
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
        hit_ball(event, member, now);
      } else {
        apply_edge(c_, event.partner, now);
      }
      if (event.partner == kExit) tally.retired();
    }
    __syncwarp();
    if (threadIdx.x >= (with_parcel ? 2U : 1U)) return;
    keep_segment(step_, members_.counts, event, member);
    set_trajectory(now, event, member, tally);
    if (event.partner == kBallPartner)
      member.has_changed = kHitBall;
    else
      member.last_contact_tick = c_.plan.start + event.tick;
  }

  // Collides a member with the ball. now: its trajectory, anchored at the event's tick.
  __device__ __forceinline__ void hit_ball(const Event& event, const Member& member, Trajectory& now) {
    const BallTrajectory& ball = kHasBall
                                     ? space_.ball.now.ball.trajectory
                                     : note_hit(step_, event.generation,
                                                {event.tick, member.id, members_.cluster, members_.attempt,
                                                 member.trajectory, member.next_generation});
    const BallReaction reaction = collide_with_ball<kBoundary>(c_, ball, event.tick, now, members_.tally);
    if constexpr (kHasBall) ball_.apply(event, member.id, reaction);
  }
};

}  // namespace pf::cuda
