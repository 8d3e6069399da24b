// Method `exact` on the device: functions that the solvers of a warp and of a block share.
#pragma once

#include "cuda/exact/ball_path.cuh"
#include "cuda/exact/clusters.cuh"
#include "cuda/exact/event_order.cuh"

namespace pf::cuda {

// Attempts to solve clusters in a round are numbered from this times the round on.
constexpr std::uint32_t kMaxAttemptsInRound = 1024;

// Notes two clusters that must be solved as one. If they are the same, that one needs a whole block.
__device__ inline void add_conflict(const StepContext& step, const SliceCounts& counts, std::uint32_t p,
                                    std::uint32_t q) {
  const std::uint32_t k = atomicAdd(&step.state.num_conflicts[counts.alone], 1U);
  if (k < step.memory.conflict_capacity) {
    step.memory.conflicts[k] = {p, q};
  } else {
    step.state.solve_failed = 1;
  }
}

// Notes parcels of two clusters that are near each other.
__device__ __forceinline__ void add_neighbour_pair(const StepContext& step, SliceCounts& counts,
                                                   std::uint32_t i, std::uint32_t j) {
  const StepMemory& memory = step.memory;
  const std::uint32_t k = atomicAdd(&counts.neighbour_pairs, 1U);
  if (k < memory.neighbour_pair_capacity) {
    memory.neighbour_pairs[static_cast<std::size_t>(blockIdx.x) * memory.neighbour_pair_capacity + k] = {i,
                                                                                                         j};
  } else {
    step.state.solve_failed = 1;
  }
}

// Takes over the members of a cluster that was solved as a pair, as most are, so that both are solved at
// once, without another round. Returns the slot of the first one, or kInvalidIndex if it was not a pair, or
// no longer. Called by one thread.
__device__ inline std::uint32_t absorb_pair(const StepContext& step, std::uint32_t pair, std::uint32_t into) {
  const StepMemory& memory = step.memory;
  Cluster& absorbed = cluster_of(step, pair);
  if (atomicCAS(&absorbed.solution, kSolvedAsPair, kUnsolved) != kSolvedAsPair) return kInvalidIndex;
  const std::uint32_t first = absorbed.members;
  absorbed.members = kInvalidIndex;
  absorbed.parent = into;
  std::uint32_t m = first;
  for (unsigned k = 0; k < 2 && m != kInvalidIndex; ++k, m = memory.members[m].next)
    memory.owner[memory.members[m].index] = into;
  return first;
}

// A trajectory of another lane.
__device__ __forceinline__ Trajectory of_lane(const Trajectory& trajectory, unsigned lane) {
  const auto from = [&](auto value) { return __shfl_sync(kWholeWarp, value, lane); };
  return {{from(trajectory.anchor.x), from(trajectory.anchor.y)},
          {from(trajectory.velocity.x), from(trajectory.velocity.y)},
          from(trajectory.tick)};
}

// A parcel before the window's events, without its next event.
__device__ __forceinline__ Member member_without_event(const StepContext& step, std::uint32_t i) {
  const StepMemory& memory = step.memory;
  Member member;
  member.index = i;
  member.id = step.id(i);
  member.trajectory = step.start_trajectory(i);
  const std::uint32_t* last_contact_tick = memory.trajectories.last_contact_tick;
  member.last_contact_tick = last_contact_tick ? last_contact_tick[i] : 0U;
  member.next = kInvalidIndex;
  member.last_segment = kInvalidIndex;
  member.fastest_mps = sqrtf(dot(member.trajectory.velocity, member.trajectory.velocity)) * (1.0F + 1e-6F);
  member.has_changed = kUnchanged;
  member.next_generation = 0;
  return member;
}

__device__ __forceinline__ void keep_hit(const PathHit& hit, Event& best) {
  keep_earlier(best, {hit.tick, kBallPartner, kBallPartner, hit.generation});
}

// position: of the member at the step's start.
template <Boundary kBoundary>
__device__ __forceinline__ bool may_hit_participant(const StepContext& step, Vec2i position,
                                                    const Member& member) {
  return step.has_participant() && step.is_near_ball<kBoundary>(position) &&
         !is_retired(member.trajectory.anchor);
}

// looks_at_ball: whether its event may be a hit on the ball's assumed path.
template <Boundary kBoundary>
__device__ __forceinline__ Member member_at_start(const StepContext& step, std::uint32_t i,
                                                  bool looks_at_ball) {
  Member member = member_without_event(step, i);
  const EventKey event = step.memory.events[i];
  if (tick_of(event) < step.c.plan.length)
    member.event = {tick_of(event), partner_of(event), step.id_of_partner(partner_of(event))};
  if (looks_at_ball && may_hit_participant<kBoundary>(step, step.start_positions()[i], member))
    keep_hit(hit_on_path<kBoundary>(step, {member.trajectory, member.id}), member.event);
  return member;
}

// Called by one thread of a solver at its end. num_events: of the cluster. num_tried: in all attempts.
__device__ inline void note_solved(const StepContext& step, std::uint32_t num_events,
                                   std::uint32_t num_tried) {
  ExactState& state = step.state;
  if (num_events > state.largest_cluster) atomicMax(&state.largest_cluster, num_events);
  atomicMax(&state.round_events, num_tried);
  atomicAdd(&state.num_events_solved, static_cast<unsigned long long>(num_tried));
}

// Called by one thread of a solver whose cluster has too many events before that tick.
__device__ inline void stop_at(const StepContext& step, std::uint32_t tick) {
  atomicMin(&step.state.stopped_at, tick);
  step.state.solve_failed = 1;
}

// Claims parcel i for the cluster if it is free. Returns its owner before, kInvalidIndex if it was free.
__device__ __forceinline__ std::uint32_t claim(const StepContext& step, std::uint32_t i,
                                               std::uint32_t cluster) {
  const std::uint32_t owner = atomicCAS(&step.memory.owner[i], kInvalidIndex, cluster);
  // If two clusters each claim a parcel and then look at the other's parcel, at least one of them sees the
  // other's claim.
  __threadfence();
  return owner;
}

// Slot of a new member, parcel i, in the block's slice.
__device__ __forceinline__ std::uint32_t new_member_slot(const StepContext& step, SliceCounts& counts,
                                                         std::uint32_t i) {
  const StepMemory& memory = step.memory;
  std::uint32_t k = atomicAdd(&counts.members, 1U);
  if (k >= memory.member_capacity) {
    step.state.solve_failed = 1;
    k = 0;
  }
  const std::uint32_t slot = blockIdx.x * memory.member_capacity + k;
  memory.member_slot[i] = slot;
  return slot;
}

// Makes the trajectory that an event ends a segment, unless it is the start trajectory.
__device__ __forceinline__ void keep_segment(const StepContext& step, SliceCounts& counts, const Event& event,
                                             Member& member) {
  const StepMemory& memory = step.memory;
  if (!member.has_changed) return;
  const std::uint32_t k = atomicAdd(&counts.segments, 1U);
  if (k < memory.segment_capacity) {
    const std::uint32_t segment = blockIdx.x * memory.segment_capacity + k;
    memory.segments[segment] = {member.trajectory, event.tick, member.last_segment};
    member.last_segment = segment;
  } else {
    step.state.solve_failed = 1;
  }
}

// Puts a member on the trajectory that an event led to.
__device__ __forceinline__ void set_trajectory(const Trajectory& now, const Event& event, Member& member,
                                               ClusterTally& tally) {
  const float speed2 = dot(now.velocity, now.velocity);
  member.trajectory = now;
  member.has_changed = kChanged;
  member.next_generation = event.generation + 1;
  member.fastest_mps = fmaxf(member.fastest_mps, sqrtf(speed2) * (1.0F + 1e-6F));
  tally.fastest2 = fmaxf(tally.fastest2, speed2);
}

// Search around a member for the parcels that it may collide with in the step.
struct MemberSearch {
  Vec2i position, start;  // of the parcel, and of its trajectory traced back, at the step's start
  Vec2f velocity;
  std::int32_t reach;
  float radius2;

  // fastest_mps: bound on the member's speeds in the window so far.
  template <Boundary kBoundary>
  static __device__ __forceinline__ MemberSearch around(const StepContext& step, Vec2i position,
                                                        const Trajectory& now, float fastest_mps) {
    const double radius = search_radius(step.c, static_cast<double>(fastest_mps) + step.c.plan.max_speed_mps);
    return {position, start_position<kBoundary>(step.c, now), now.velocity, step.search_reach(radius),
            static_cast<float>(radius * radius)};
  }

  // Returns whether the parcel at that position may come near the member at all.
  template <Boundary kBoundary>
  __device__ __forceinline__ bool holds(const World& world, Vec2i other) const {
    const Vec2i offset = separation<kBoundary>(world, position, other);
    const auto x = static_cast<float>(offset.x), y = static_cast<float>(offset.y);
    return x * x + y * y < radius2;
  }

  // Returns whether a parcel that stays on its start trajectory may collide with the member.
  template <Boundary kBoundary>
  __device__ __forceinline__ bool may_hit(const StepContext& step, Vec2i other, Vec2f other_velocity) const {
    return may_collide(separation<kBoundary>(step.launch.space.world, start, other),
                       other_velocity - velocity, step.contact_distance(), step.units_in_step());
  }
};

// A thread's next candidates of a search, kInvalidIndex where there are no more, with what decides whether
// they are near: loads that do not wait for each other.
template <unsigned kAhead>
struct Candidates {
  std::uint32_t index[kAhead], owner[kAhead];
  Vec2i position[kAhead];
  Vec2f velocity[kAhead];

  template <unsigned kThreads>
  __device__ __forceinline__ void load_next(const StepContext& step, const Vec2i* positions,
                                            CandidateCursor<kThreads, kAhead>& cursor) {
    cursor.next(index);
    for (unsigned u = 0; u < kAhead; ++u) {
      const std::uint32_t j = min(index[u], step.launch.space.num_parcels - 1);
      owner[u] = step.owner_of(j);
      position[u] = positions[j];
      velocity[u] = step.memory.trajectories.velocity[j];
    }
  }
};

__device__ __forceinline__ ParcelNearBall near_ball(const Member& member) {
  return {member.trajectory, member.id, member.next_generation, member.has_changed == kHitBall};
}

// Generation of an event at `tick` of a parcel on a trajectory.
__device__ __forceinline__ std::uint32_t generation_of(const StepContext& step, std::uint32_t tick,
                                                       const Trajectory& now, std::uint32_t next_generation) {
  return generation_at(tick, anchor_time(step.c.plan, now), next_generation);
}

// Replaces `best` if a parcel reaches the edge before it. position: at the step's start.
template <Boundary kBoundary>
__device__ __forceinline__ void keep_edge(const StepContext& step, Vec2i position, const ParcelNearBall& it,
                                          Event& best) {
  if (!may_reach_edge<kBoundary>(step.c, position)) return;
  Event edge;
  keep_edge_event<kBoundary>(step.c, it.trajectory, edge);
  edge.generation = generation_of(step, edge.tick, it.trajectory, it.next_generation);
  keep_earlier(best, edge);
}

// The same for the edge and the ball.
template <Boundary kBoundary>
__device__ __forceinline__ void keep_edge_and_ball(const StepContext& step, Vec2i position,
                                                   const ParcelNearBall& it, Event& best) {
  keep_edge<kBoundary>(step, position, it, best);
  if (step.c.plan.ball == BallRole::absent || !step.is_near_ball<kBoundary>(position)) return;
  keep_hit(hit_on_path<kBoundary>(step, it), best);
}

// The trajectory on the assumed path that the ball is on before a hit. hit.segment is set here.
__device__ __forceinline__ const BallTrajectory& trajectory_before(const StepContext& step,
                                                                   std::uint32_t generation, BallHit& hit) {
  const BallSegment* path = ball_path(step);
  hit.segment = segment_before(path, step.state.num_ball_segments, {hit.tick, hit.id, hit.id, generation});
  return path[hit.segment].trajectory;
}

// The same, for one thread, which notes the hit.
__device__ __forceinline__ const BallTrajectory& note_hit(const StepContext& step, std::uint32_t generation,
                                                          BallHit hit) {
  const BallTrajectory& ball = trajectory_before(step, generation, hit);
  if (step.has_participant()) add_ball_hit(step, hit);
  return ball;
}

}  // namespace pf::cuda
