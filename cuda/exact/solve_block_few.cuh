// Method `exact` on the device: the events of a cluster of at most 32 members, which a block solves.
//
// Each warp keeps all members, one in the registers of each lane, and applies each event itself. So no warp
// waits for another before it predicts, and there is one barrier for an event. What the predictions are to
// compare with is loaded before the event is applied.
#pragma once

#include "cuda/exact/solve_block_few_predict.cuh"

namespace pf::cuda {

// All threads of the block call the functions of this class together.
template <Boundary kBoundary, bool kHasBall>
class BlockFewMembers : protected BlockFewPredictions<kBoundary, kHasBall> {
 protected:
  static constexpr std::uint32_t kBallPlace = 0xFFFFFFFEU;  // of its event, if it is a member

  enum class Progress { goes_on, solved, stopped, needs_memory };

  __device__ __forceinline__ BlockFewMembers(const StepContext& step, BlockSpace& space, SliceCounts& counts)
      : Base(step, space, counts), max_events_(step.state.max_events) {}

  // Applies events in their order. solved: up to the window's end. stopped: another cluster owns a partner.
  // needs_memory: the members do not fit into registers, or what is near them into its lists; those that are
  // flagged then must be predicted.
  __device__ __forceinline__ Progress process_few() {
    this->take_members();
    for (bool has_event = !kHasBall;; has_event = true) {
      Turn turn;
      Event event;
      if (has_event) {
        const OrderedEvent next = next_event(event);
        if (next.tick == kNoTick || is_stopped(next)) return give_members(Progress::solved);
        const Progress progress = begin(next, event, turn);
        if (progress != Progress::goes_on) return give_members(progress);
      }
      Task task = this->prepare(turn, 0);
      if (has_event) apply(event, turn);
      if (!this->predict(turn, task)) {
        this->flag(turn);
        return give_members(Progress::needs_memory);
      }
    }
  }

  // Returns whether the cluster has too many events before this one.
  __device__ __forceinline__ bool is_stopped(const OrderedEvent& next) {
    if (members_.tally.num_events != max_events_) return false;
    if (members_.leads()) stop_at(step_, next.tick);
    return true;
  }

  // Claims the ball for the cluster; or another cluster has it. Called by the first thread.
  __device__ __forceinline__ void join_ball() {
    const std::uint32_t owner = claim_ball(step_, members_.cluster);
    space_.other = owner == kInvalidIndex ? members_.cluster : owner;
    space_.ball_joins = owner == kInvalidIndex ? 1U : 0U;
  }

  using Base = BlockFewPredictions<kBoundary, kHasBall>;
  using Base::ball_, Base::ball_event_, Base::c_, Base::it_, Base::members_, Base::num_, Base::space_,
      Base::step_;
  using Base::is_member, Base::kMaxMembers, Base::kNoLane, Base::lane, Base::of_lane, Base::warp;
  using typename Base::Task, typename Base::Turn;

 private:
  __device__ __forceinline__ Progress give_members(Progress progress) {
    if (warp() == 0 && is_member()) space_.hot[lane()] = it_;
    return progress;
  }

  // The earliest event; its place is the lane of a member that has it. event: as that sees it.
  __device__ __forceinline__ OrderedEvent next_event(Event& event) const {
    const Event& own = it_.event;
    const unsigned first = first_lane({is_member() ? own.tick : kNoTick, own.generation,
                                       min(it_.id, own.partner_id), max(it_.id, own.partner_id)});
    OrderedEvent best;
    if (first < kNoLane) {
      event = of_lane(own, first);
      const std::uint32_t id = of_lane(it_.id, first);
      best = {event.tick, event.generation, min(id, event.partner_id), max(id, event.partner_id), first};
    }
    if constexpr (!kHasBall) return best;
    const OrderedEvent other{ball_event_.tick, ball_event_.generation, ball_event_.partner_id, kBallPartner,
                             kBallPlace};
    if (ball_event_.tick == kNoTick || !comes_before(other, best)) return best;
    event = ball_event_;
    return other;
  }

  // Finds the members that the event concerns; its partner joins if it is free. The ball's event with a
  // parcel becomes that of the parcel with the ball.
  __device__ __forceinline__ Progress begin(const OrderedEvent& next, Event& event, Turn& turn) {
    const bool of_ball = kHasBall && next.place == kBallPlace;
    if (!kHasBall && event.partner == kBallPartner && ball_joins(step_)) {
      if (members_.leads()) join_ball();
      return Progress::stopped;
    }
    const unsigned own = of_ball ? kNoLane : next.place;
    const std::uint32_t index = of_ball ? kBallPartner : of_lane(it_.index, own);
    const bool with_parcel = is_parcel(event.partner), is_other = is_member() && lane() != own;
    const unsigned partner = __ballot_sync(kWholeWarp, is_other && with_parcel && it_.index == event.partner);
    const bool is_undone =
        is_other && (it_.event.partner == index || (with_parcel && it_.event.partner == event.partner));
    turn.stale = __ballot_sync(kWholeWarp, is_undone) & ~partner;
    unsigned other = partner != 0 ? __ffs(partner) - 1 : kNoLane;
    if (with_parcel && partner == 0) {
      if (num_ == kMaxMembers) return Progress::needs_memory;
      if constexpr (kHasBall) ball_.forget(event.partner);
      const std::uint32_t place = members_.join(event.partner);
      if (place == kInvalidIndex) return Progress::stopped;
      num_ = place + 1;
      other = place;
      if (lane() == place) this->take_member(place);
    }
    ++members_.tally.num_events;
    if (threadIdx.x == 32)
      space_.event_hash += event_hash(step_.since_reset(event.tick), next.low_id, next.high_id);
    turn.own = of_ball ? other : own;
    turn.other = of_ball ? kNoLane : other;
    if (of_ball && with_parcel) event.partner = kBallPartner;
    return Progress::goes_on;
  }

  // Each warp applies the event to its members; the first one keeps what else follows from it.
  __device__ __forceinline__ void apply(const Event& event, const Turn& turn) {
    ClusterTally& tally = members_.tally;
    if (turn.own == kNoLane) {
      apply_to_ball(event, event.partner, {});
      return;
    }
    Trajectory now = it_.trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    const bool takes_part = lane() == turn.own || lane() == turn.other;
    if (turn.other != kNoLane) {
      const bool recent = takes_part && is_in_contact(c_.plan, event.tick, it_.last_contact_tick);
      const bool swap = of_lane(it_.id, turn.other) < of_lane(it_.id, turn.own);
      const unsigned first_lane = swap ? turn.other : turn.own;
      Trajectory first = of_lane(now, first_lane), second = of_lane(now, swap ? turn.own : turn.other);
      const bool elastic = __any_sync(kWholeWarp, recent) != 0;
      ClusterTally ignored;
      if (warp() == 0) {
        collide<kBoundary>(c_, first, second, elastic, tally);
      } else {
        collide<kBoundary>(c_, first, second, elastic, ignored);
      }
      now = lane() == first_lane ? first : second;
    } else {
      now = of_lane(now, turn.own);
      if (event.partner == kBallPartner) {
        hit_ball(event, turn.own, now);
      } else {
        apply_edge(c_, event.partner, now);
      }
      if (event.partner == kExit) tally.retired();
    }
    if (!takes_part) return;
    if (warp() == 0) keep_segment(step_, members_.counts, event, it_);
    set_trajectory(now, event, it_, tally);
    if (event.partner == kBallPartner)
      it_.has_changed = kHitBall;
    else
      it_.last_contact_tick = c_.plan.start + event.tick;
  }

  // Collides a member with the ball. now: its trajectory, anchored at the event's tick, in all lanes.
  __device__ __forceinline__ void hit_ball(const Event& event, unsigned own, Trajectory& now) {
    const std::uint32_t id = of_lane(it_.id, own);
    const Trajectory before = of_lane(it_.trajectory, own);
    const std::uint32_t next_generation = of_lane(it_.next_generation, own);
    BallTrajectory ball;
    if constexpr (kHasBall) {
      ball = space_.ball.now.ball.trajectory;
    } else {
      BallHit hit{event.tick, id, members_.cluster, members_.attempt, before, next_generation};
      ball = trajectory_before(step_, event.generation, hit);
      if (members_.leads() && step_.has_participant()) add_ball_hit(step_, hit);
    }
    const BallReaction reaction = collide_with_ball<kBoundary>(c_, ball, event.tick, now, members_.tally);
    if constexpr (kHasBall) apply_to_ball(event, id, reaction);
  }

  // partner_id: as in Event. No warp reads what the ball was before any more when it returns.
  __device__ __forceinline__ void apply_to_ball(const Event& event, std::uint32_t partner_id,
                                                const BallReaction& reaction) {
    __syncthreads();
    if (members_.leads()) ball_.apply(event, partner_id, reaction);
    __syncthreads();
  }

  std::uint32_t max_events_;
};

}  // namespace pf::cuda
