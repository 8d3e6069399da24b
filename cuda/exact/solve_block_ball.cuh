// Method `exact` on the device: the ball as a member of a cluster that a block solves.
//
// Its next event is found anew after each event of the cluster: each thread compares the ball with one body,
// so nothing of it is ever stale.
#pragma once

#include "cuda/exact/solve_block_members.cuh"

namespace pf::cuda {

// All threads of the block call the functions of this class together, unless noted. It does not keep a
// reference to the members: an object that refers to one beside it lies in memory, not in registers, and each
// event takes a quarter longer.
template <Boundary kBoundary>
class BlockBallMember {
 public:
  __device__ __forceinline__ BlockBallMember(const StepContext& step, BlockSpace& space)
      : step_(step), c_(step.c), state_(step.state), memory_(step.memory), ball_(space.ball) {}

  // Puts the ball where it is at the window's start, and lists the parcels outside the cluster that may hit
  // it. The members are loaded.
  __device__ __forceinline__ void load(std::uint32_t cluster) const {
    if (threadIdx.x == 0) {
      ball_.now = {state_.ball, 0, 1};
      ball_.num_outside = 0;
      ball_.is_bent = 0;
      write_segment(memory_, state_.ball_path ^ 1U, ball_.now, {0, 0, 0, 0}, {});
    }
    __syncthreads();
    const BallTrajectory start = ball_.now.ball.trajectory;
    const std::uint32_t num_near = num_near_ball();
    for (std::uint32_t k = threadIdx.x; k < num_near; k += kExactBlock) {
      const std::uint32_t i = memory_.near_ball.items[k];
      const Trajectory there = step_.start_trajectory(i);
      const std::uint32_t id = step_.id(i), owner = step_.owner_of(i);
      std::uint32_t tick = 0;
      if (is_retired(there.anchor) || owner == cluster ||
          !meets_straight_path<kBoundary>(step_, start, {there, id}, tick))
        continue;
      const std::uint32_t place = atomicAdd(&ball_.num_outside, 1U);
      if (place < BlockBall::kMaxOutside) ball_.outside[place] = {i, id};
    }
    __syncthreads();
  }

  // A body that the ball is compared with. index: kInvalidIndex if there is none.
  struct Body {
    std::uint32_t index, id, next_generation;
    Trajectory trajectory;
  };

  // Replaces `best` if the body hits the ball before it; the partner is the parcel.
  __device__ __forceinline__ void keep_hit_by(const Body& body, Event& best) const {
    if (body.index == kInvalidIndex || is_retired(body.trajectory.anchor)) return;
    const std::uint32_t tick = ball_collision_tick<kBoundary>(c_, ball_.now.ball.trajectory, body.trajectory);
    const std::uint32_t generation = max(generation_of_ball(ball_.now, tick),
                                         generation_of(step_, tick, body.trajectory, body.next_generation));
    keep_earlier(best, {tick, body.index, body.id, generation});
  }

  // The parcels outside that it is compared with: those that were listed, or all near the ball.
  __device__ __forceinline__ bool is_listed() const {
    return ball_.is_bent == 0 && ball_.num_outside <= BlockBall::kMaxOutside;
  }
  __device__ __forceinline__ std::uint32_t num_outside(bool are_listed) const {
    return are_listed ? ball_.num_outside : num_near_ball();
  }
  __device__ __forceinline__ Body outside(std::uint32_t k, bool are_listed, std::uint32_t cluster) const {
    if (are_listed) {
      const BlockBall::Outside& it = ball_.outside[k];
      if (it.index == kInvalidIndex) return {kInvalidIndex, 0, 0, {}};
      return {it.index, it.id, 0, step_.start_trajectory(it.index)};
    }
    const std::uint32_t i = memory_.near_ball.items[k];
    return {step_.owner_of(i) == cluster ? kInvalidIndex : i, step_.id(i), 0, step_.start_trajectory(i)};
  }

  // This thread's part of the search for the ball's next hit.
  __device__ __forceinline__ Event first_hit(const BlockMembers& members) const {
    const std::uint32_t num_members = members.num();
    const bool are_listed = is_listed();
    const std::uint32_t num_bodies = num_members + num_outside(are_listed);
    Event best;
    for (std::uint32_t k = threadIdx.x; k < num_bodies; k += kExactBlock)
      keep_hit_by(
          k < num_members ? member_of(members[k]) : outside(k - num_members, are_listed, members.cluster),
          best);
    return best;
  }

  // Makes the ball's next event the first of these hits, or a wall before them. Called by one thread.
  __device__ __forceinline__ void keep_event(const Event (&first_of_warps)[BlockSpace::kWarps]) const {
    Event hit;
    for (const Event& event : first_of_warps) keep_earlier(hit, event);
    ball_.event = next_ball_event<kBoundary>(c_, ball_.now, hit);
  }

  // The ball's present trajectory ends with the event. partner_id: as in Event. Called by one thread.
  __device__ __forceinline__ void apply(const Event& event, std::uint32_t partner_id,
                                        const BallReaction& reaction) const {
    TracedBall& now = ball_.now;
    if (!has_room(state_, now)) return;
    apply_to_ball(c_, event.tick, is_parcel(partner_id) ? kBallPartner : partner_id, reaction, now.ball);
    now.next_generation = event.generation + 1;
    ++now.num_segments;
    const Event begin{event.tick, partner_id, partner_id, event.generation};
    write_segment(memory_, state_.ball_path ^ 1U, now, begin, {});
    const BallSegment segment{now.ball.trajectory, event.tick, partner_id, now.next_generation};
    if (summary_of(c_, state_, segment).is_bent) ball_.is_bent = 1;
  }

  // Parcel i has joined the cluster.
  __device__ __forceinline__ void forget(std::uint32_t i) const {
    const unsigned k = threadIdx.x;
    if (k < min(ball_.num_outside, BlockBall::kMaxOutside) && ball_.outside[k].index == i)
      ball_.outside[k].index = kInvalidIndex;
  }

  // Publishes the path and where it ends. Walls are counted with the cluster's events. Called by one thread.
  __device__ __forceinline__ void finish() const {
    state_.num_solved_segments = ball_.now.num_segments;
    state_.solved_path_is_straight = ball_.is_bent == 0 ? 1U : 0U;
    state_.ball_at_end = ball_.now.ball;
    state_.num_wall_events = 0;
    state_.wall_event_hash = 0;
  }

 private:
  __device__ __forceinline__ std::uint32_t num_near_ball() const {
    return min(state_.num_near_ball, memory_.near_ball.capacity);
  }

  static __device__ __forceinline__ Body member_of(const Member& it) {
    return {it.index, it.id, it.next_generation, it.trajectory};
  }

  const StepContext& step_;
  const ExactConstants& c_;
  ExactState& state_;
  const StepMemory& memory_;
  BlockBall& ball_;
};

}  // namespace pf::cuda
