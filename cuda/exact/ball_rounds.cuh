// Method `exact` on the device: rounds of solving, and between them the ball's path, until both agree.
#pragma once

#include "cuda/exact/ball_retrace.cuh"
#include "cuda/exact/reconcile.cuh"

namespace pf::cuda {

__device__ inline bool belongs_to_solution(const StepContext& step, const BallHit& hit) {
  const Cluster& cluster = cluster_of(step, hit.cluster);
  return cluster.parent == hit.cluster && cluster.solution != kUnsolved && cluster.attempt == hit.attempt;
}

// Returns false if parcel i certainly does not hit the ball on the path that solvers assume.
template <Boundary kBoundary>
__device__ bool may_hit_path(const StepContext& step, std::uint32_t i) {
  const BallPath path = assumed_path(step);
  if (!path.is_straight || path.num == 1) return true;
  const std::uint32_t id = step.id(i);
  return any_trajectory(step, i, [&](const Trajectory& trajectory, std::uint32_t) {
    std::uint32_t tick = 0;
    return meets_straight_path<kBoundary>(step, path.segments[0].trajectory, {trajectory, id}, tick);
  });
}

// The same as hit_from_segment on the path that solvers assume, by a whole warp.
template <Boundary kBoundary>
__device__ PathHit hit_by_warp(const StepContext& step, const ParcelNearBall& parcel, std::uint32_t first) {
  const BallPath path = assumed_path(step);
  for (std::uint32_t base = first; base < path.num; base += 32) {
    const std::uint32_t s = base + threadIdx.x % 32;
    PathHit hit;
    if (s < path.num) hit = hit_on_segment<kBoundary>(step, path, s, parcel);
    const unsigned hits = __ballot_sync(kWholeWarp, hit.tick != kNoTick);
    if (hits == 0) continue;
    const unsigned lane = __ffs(hits) - 1;
    return {__shfl_sync(kWholeWarp, hit.tick, lane), __shfl_sync(kWholeWarp, hit.generation, lane),
            base + lane};
  }
  return {};
}

// The same as hits_path there.
template <Boundary kBoundary>
__device__ bool hits_path_by_warp(const StepContext& step, std::uint32_t i, std::uint32_t first_segment) {
  const std::uint32_t id = step.id(i);
  return any_trajectory(step, i, [&](const Trajectory& trajectory, std::uint32_t end) {
    const std::uint32_t tick = hit_by_warp<kBoundary>(step, {trajectory, id}, first_segment).tick;
    return tick != kNoTick && tick <= end;
  });
}

// Returns whether parcel i hits the ball on its start trajectory, and the path does not have that hit. The
// solver does not see it if the parcel joined its cluster only after that. A whole warp calls it.
template <Boundary kBoundary>
__device__ bool has_unseen_hit(const StepContext& step, std::uint32_t i) {
  const std::uint32_t id = step.id(i);
  bool is_there = false;
  Trajectory start{};
  std::uint32_t start_end = 0;
  any_trajectory(step, i, [&](const Trajectory& trajectory, std::uint32_t end) {
    is_there = true;
    start = trajectory;
    start_end = end;
    return false;
  });
  if (!is_there) return false;
  const PathHit hit = hit_by_warp<kBoundary>(step, {start, id}, 0);
  return hit.tick != kNoTick && hit.tick <= start_end &&
         !has_hit(step, step.state.num_ball_segments, {hit.tick, id, 0, 0, start, 0, hit.segment});
}

// Makes parcel i, which belongs to no cluster, one that is solved next.
__device__ inline void add_cluster(const StepContext& step, SliceCounts& counts, std::uint32_t i,
                                   std::uint32_t round) {
  const StepMemory& memory = step.memory;
  if (atomicCAS(&memory.owner[i], kInvalidIndex, i) != kInvalidIndex) return;
  const std::uint32_t slot = new_member_slot(step, counts, i);
  memory.members[slot].index = i;
  memory.members[slot].next = kInvalidIndex;
  Cluster& cluster = memory.clusters[slot];
  start_cluster(cluster, i);
  cluster.merged = slot;
  cluster.reassigned = round;
  const std::uint32_t k = atomicAdd(&step.state.num_todo, 1U);
  if (k < memory.todo.capacity) {
    memory.todo.items[k] = i;
  } else {
    step.state.solve_failed = 1;
  }
}

// Lists the clusters to be solved next: if the path has changed, those that it concerns; and parcels outside
// clusters that would hit the ball.
//
// The path may have changed from the end of its last `same` segment on. A change does not concern a cluster
// whose hits all begin one of the same segments, and of whose trajectories none would hit the ball on the
// last of these or later. Its solver would find on the new path what it has found on the old one: a hit that
// begins one of the same segments lies on a segment whose end is the same, too. Any other hit on a segment
// with the same end came too late for a trajectory on the old path, and still does. On the last of the same
// segments, whose end has changed, and on later ones there is none. So the cluster is as if it had been
// solved against the new path, and its hits as if they had been found there.
//
// That holds for trajectories that a solver has compared with the path. It does not compare the start
// trajectory of a parcel that joins its cluster. No such trajectory hits a path that is checked. If the path
// is not, start trajectories are compared here.
template <Boundary kBoundary>
__device__ void find_clusters_at_ball(const StepContext& step, SliceCounts& counts, bool has_changed,
                                      bool is_checked, std::uint32_t round) {
  const StepMemory& memory = step.memory;
  ExactState& state = step.state;
  const StepTeam team;
  const std::uint32_t num_same = load_fresh(&state.num_same_segments);
  const std::uint32_t num_logged = has_changed ? min(state.num_ball_hits, memory.ball_hit_capacity) : 0U;
  for (std::uint32_t k = team.spread_rank(); k < num_logged; k += team.num_threads()) {
    const BallHit& hit = memory.ball_hits[k];
    const Cluster& cluster = cluster_of(step, hit.cluster);
    if (cluster.parent == hit.cluster && cluster.attempt == hit.attempt && !has_hit(step, num_same, hit))
      reassign_members(step, hit.cluster, round);
  }
  // Few parcels come close to the path. Threads find them, each looking at another one; then the warp looks
  // along the path for each of them.
  const std::uint32_t num_near = min(state.num_near_ball, memory.near_ball.capacity);
  for (std::uint32_t base = 0; base + team.rank() / 32 < num_near; base += team.num_threads()) {
    const std::uint32_t k = base + team.spread_rank();
    std::uint32_t i = 0, owner = kInvalidIndex;
    bool looks = k < num_near;
    if (looks) {
      i = memory.near_ball.items[k];
      owner = step.owner_of(i);
      looks = (owner == kInvalidIndex || load_fresh(&cluster_of(step, owner).reassigned) != round) &&
              may_hit_path<kBoundary>(step, i);
    }
    for (unsigned left = __ballot_sync(kWholeWarp, looks); left != 0; left &= left - 1) {
      const unsigned lane = __ffs(left) - 1;
      const std::uint32_t parcel = __shfl_sync(kWholeWarp, i, lane);
      const bool is_free = __shfl_sync(kWholeWarp, owner, lane) == kInvalidIndex;
      const bool hits = is_free ? hits_path_by_warp<kBoundary>(step, parcel, 0)
                                : (has_changed && hits_path_by_warp<kBoundary>(step, parcel, num_same - 1)) ||
                                      (!is_checked && has_unseen_hit<kBoundary>(step, parcel));
      if (!hits || threadIdx.x % 32 != lane) continue;
      if (is_free)
        add_cluster(step, counts, i, round);
      else
        reassign_members(step, owner, round);
    }
  }
}

// Traces the ball's path through the hits of the solution. Returns whether clusters are listed to be solved,
// against a path that has changed. round: of the first block's next one; then that in which they are solved.
// The grid calls it.
template <Boundary kBoundary>
__device__ __forceinline__ bool update_ball_path(const StepContext& step, PathHits& space,
                                                 SliceCounts& counts, std::uint32_t& round) {
  const cg::grid_group grid = cg::this_grid();
  ExactState& state = step.state;
  if (blockIdx.x == 0) {
    const bool is_hit = load_fresh(&state.num_ball_segments) + load_fresh(&state.num_ball_hits) > 1;
    if (is_hit && load_fresh(&state.solve_failed) == 0) {
      trace_ball_path<kBoundary>(step, space, state.num_ball_segments,
                                 [&](const BallHit& hit) { return belongs_to_solution(step, hit); });
    } else if (threadIdx.x == 0) {
      state.path_has_changed = 0;
      state.path_is_checked = 1;
    }
    if (threadIdx.x == 0) {
      if (is_hit && round > kMaxRounds) state.solve_failed = 1;
      state.num_todo = 0;
      state.num_conflicts[0] = 0;
      state.round = round;
    }
  }
  grid.sync();
  round = load_fresh(&state.round);  // the first block may have done more rounds, alone
  const bool has_changed = load_fresh(&state.path_has_changed) != 0;
  const bool is_checked = load_fresh(&state.path_is_checked) != 0;
  if (!has_changed && is_checked) return false;
  find_clusters_at_ball<kBoundary>(step, counts, has_changed, is_checked, round);
  ++round;
  grid.sync();
  if (blockIdx.x == 0 && threadIdx.x == 0) state.path_is_checked = 1;
  return load_fresh(&state.num_todo) != 0;
}

// Solves the window. Each block has its own spaces.
template <Boundary kBoundary>
__device__ __forceinline__ void solve_all(const StepContext& step, ClusterSpace& space, PathHits& hits,
                                          SliceCounts& counts) {
  std::uint32_t round = 0;
  do {
    solve_in_rounds<kBoundary>(step, space, counts, round);
  } while (step.has_participant() && !ball_joins(step) &&
           update_ball_path<kBoundary>(step, hits, counts, round));
}

}  // namespace pf::cuda
