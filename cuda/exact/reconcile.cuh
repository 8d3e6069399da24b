// Method `exact` on the device, fourth stage of a step: finding clusters whose solutions contradict each
// other, and merging them.
#pragma once

#include "cuda/exact/ball_path.cuh"
#include "cuda/exact/solve.cuh"

namespace pf::cuda {

// With at most so many conflicts left, one block solves the rest alone: its barrier costs a tenth of the
// grid's. It solves the clusters of several conflicts one after the other, so more is no gain: with 8 the
// worst frame of the court of 10^7 takes 183 ms instead of 177.
constexpr std::uint32_t kMaxConflictsAlone = 1;
// Beyond it the window is retried, shorter.
constexpr std::uint32_t kMaxRounds = 200;

// Calls visit(trajectory, end) for the trajectories that events of the window led parcel i to, latest first,
// until it returns true. Returns whether it did. end: tick of the step.
template <class Visit>
__device__ bool any_segment(const StepContext& step, std::uint32_t i, Visit visit) {
  const StepMemory& memory = step.memory;
  const Member& member = memory.members[memory.member_slot[i]];
  if (!member.has_changed) return false;
  if (!is_retired(member.trajectory.anchor) && visit(member.trajectory, step.c.plan.length)) return true;
  for (std::uint32_t s = member.last_segment; s != kInvalidIndex; s = memory.segments[s].previous) {
    if (visit(memory.segments[s].trajectory, memory.segments[s].end)) return true;
  }
  return false;
}

template <Boundary kBoundary>
__device__ bool trajectories_collide(const StepContext& step, std::uint32_t i, std::uint32_t j) {
  return any_segment(step, i, [&](const Trajectory& p, std::uint32_t p_end) {
    return any_segment(step, j, [&](const Trajectory& q, std::uint32_t q_end) {
      return happens_on_both(collision_tick<kBoundary>(step.c, p, q), p_end, q_end);
    });
  });
}

// Calls visit(trajectory, end) for parcel i's trajectories in the window, the start trajectory last, until it
// returns true. Returns whether it did. end: tick of the step.
template <class Visit>
__device__ bool any_trajectory(const StepContext& step, std::uint32_t i, Visit visit) {
  const Trajectory start = step.start_trajectory(i);
  if (is_retired(start.anchor)) return false;
  std::uint32_t start_end = step.c.plan.length;
  if (step.owner_of(i) != kInvalidIndex &&
      any_segment(step, i, [&](const Trajectory& trajectory, std::uint32_t end) {
        start_end = static_cast<std::uint32_t>(anchor_time(step.c.plan, trajectory));
        return visit(trajectory, end);
      }))
    return true;
  return visit(start, start_end);
}

// Returns whether a trajectory of parcel i in the window hits the ball on a path, from a segment on.
template <Boundary kBoundary>
__device__ bool hits_path(const StepContext& step, const BallPath& path, std::uint32_t i,
                          std::uint32_t first_segment) {
  const std::uint32_t id = step.id(i);
  return any_trajectory(step, i, [&](const Trajectory& trajectory, std::uint32_t end) {
    const std::uint32_t tick = hit_from_segment<kBoundary>(step, path, {trajectory, id}, first_segment).tick;
    return tick != kNoTick && tick <= end;
  });
}

// If the ball is a member of a cluster that is solved: parcels of other clusters must not hit it. No free
// parcel does, since the solver has compared these.
template <Boundary kBoundary>
__device__ void find_ball_conflicts(const StepContext& step, const StepTeam& team,
                                    const SliceCounts& counts) {
  const StepMemory& memory = step.memory;
  const std::uint32_t ball = owner_of_ball(step);
  if (ball == kInvalidIndex || cluster_of(step, ball).solution == kUnsolved) return;
  const std::uint32_t num_near = min(step.state.num_near_ball, memory.near_ball.capacity);
  for (std::uint32_t k = team.spread_rank(); k < num_near; k += team.num_threads()) {
    const std::uint32_t i = memory.near_ball.items[k], owner = step.owner_of(i);
    if (owner == kInvalidIndex || owner == ball || cluster_of(step, owner).solution == kUnsolved) continue;
    if (hits_path<kBoundary>(step, solved_path(step), i, 0)) add_conflict(step, counts, owner, ball);
  }
}

// Each block tests the pairs of neighbours that it noted.
template <Boundary kBoundary>
__device__ void find_parcel_conflicts(const StepContext& step, SliceCounts& counts) {
  const StepMemory& memory = step.memory;
  const uint2* pairs =
      memory.neighbour_pairs + static_cast<std::size_t>(blockIdx.x) * memory.neighbour_pair_capacity;
  const std::uint32_t num = min(counts.neighbour_pairs, memory.neighbour_pair_capacity);
  StepTeam block;
  block.alone = true;
  for (std::uint32_t k = block.spread_rank(); k < num; k += kExactBlock) {
    const uint2 pair = pairs[k];
    const std::uint32_t p = memory.owner[pair.x], q = memory.owner[pair.y];
    if (p != q && cluster_of(step, p).solution != kUnsolved && cluster_of(step, q).solution != kUnsolved &&
        trajectories_collide<kBoundary>(step, pair.x, pair.y))
      add_conflict(step, counts, p, q);
  }
  __syncthreads();
  if (threadIdx.x == 0) counts.neighbour_pairs = 0;
}

template <Boundary kBoundary>
__device__ void find_conflicts(const StepContext& step, const StepTeam& team, SliceCounts& counts) {
  ExactState& state = step.state;
  if (team.rank() == 0) {
    state.num_todo = 0;
    state.serial_events += state.round_events;
    state.round_events = 0;
  }
  find_parcel_conflicts<kBoundary>(step, counts);
  if (ball_joins(step)) find_ball_conflicts<kBoundary>(step, team, counts);
}

// Gives the members of a cluster to the root of its set. Does nothing if that was done in this round.
__device__ inline void reassign_members(const StepContext& step, std::uint32_t name, std::uint32_t round) {
  const StepMemory& memory = step.memory;
  ExactState& state = step.state;
  Cluster& cluster = cluster_of(step, name);
  if (atomicExch(&cluster.reassigned, round) == round) return;
  cluster.solution = kUnsolved;
  const std::uint32_t root = find_root(step, name);
  Cluster& into = cluster_of(step, root);
  std::uint32_t last = kInvalidIndex;
  for (std::uint32_t m = cluster.members; m != kInvalidIndex; m = memory.members[m].next) {
    memory.owner[memory.members[m].index] = root;
    last = m;
  }
  if (last != kInvalidIndex) memory.members[last].next = atomicExch(&into.merged, cluster.members);
  if (cluster.needs_block) into.needs_block = 1;
  // There is room in `todo`: conflicts are no fewer, nor are parcels near the ball, which each cluster that
  // find_clusters_at_ball() takes has.
  if (root == name) memory.todo.items[atomicAdd(&state.num_todo, 1U)] = root;
}

// Merges the clusters of every conflict into one. The results are the new `todo`.
__device__ inline void merge(const StepContext& step, const StepTeam& team, std::uint32_t num_conflicts,
                             std::uint32_t round) {
  const uint2* conflicts = step.memory.conflicts;
  for (std::uint32_t k = team.leader_rank(); k < num_conflicts; k += team.num_warps())
    union_sets(step, holder_of(step, conflicts[k].x), holder_of(step, conflicts[k].y));
  team.barrier();
  if (team.rank() == 0) step.state.num_conflicts[team.alone ? 1 : 0] = 0;
  for (std::uint32_t k = team.leader_rank(); k < 2 * num_conflicts; k += team.num_warps()) {
    const uint2 pair = conflicts[k / 2];
    reassign_members(step, holder_of(step, k % 2 == 0 ? pair.x : pair.y), round);
  }
  team.barrier();
}

// Finds conflicts and merges clusters. Returns whether this block's work on the step is done: there are no
// conflicts, or the step failed, or the first block does the rest alone.
template <Boundary kBoundary>
__device__ __forceinline__ bool find_and_merge(const StepContext& step, StepTeam& team, SliceCounts& counts,
                                               std::uint32_t round) {
  find_conflicts<kBoundary>(step, team, counts);
  team.barrier();
  // All blocks must decide alike, however late they come. The first block may go on alone, change
  // solve_failed, and then clear num_conflicts[0] before others have read it. It held more than
  // kMaxConflictsAlone only if solve_failed was set before; a block that reads 0 instead ends here as well.
  const std::uint32_t num_conflicts = load_fresh(&step.state.num_conflicts[team.alone ? 1 : 0]);
  if (num_conflicts == 0) return true;
  if (!team.alone && num_conflicts <= kMaxConflictsAlone) {
    team.alone = true;
    if (blockIdx.x != 0) return true;
    if (threadIdx.x == 0) counts.alone = 1;
  }
  if (load_fresh(&step.state.solve_failed) != 0) return true;
  merge(step, team, num_conflicts, round);
  return false;
}

// The same, timed by the first thread of all.
template <Boundary kBoundary>
__device__ __forceinline__ bool reconcile(const StepContext& step, StepTeam& team, SliceCounts& counts,
                                          std::uint32_t round) {
  const bool keeps_time = blockIdx.x == 0 && threadIdx.x == 0;
  if (keeps_time) step.state.reconcile_ns -= global_time_ns();
  const bool is_done = find_and_merge<kBoundary>(step, team, counts, round);
  if (keeps_time) step.state.reconcile_ns += global_time_ns();
  return is_done;
}

// Solves all clusters in rounds of solving and reconciling, until there are no conflicts. round: number of
// the first one; then of the next.
template <Boundary kBoundary>
__device__ __forceinline__ void solve_in_rounds(const StepContext& step, ClusterSpace& space,
                                                SliceCounts& counts, std::uint32_t& round) {
  StepTeam team;
  for (bool is_done = false; !is_done; ++round) {
    if (threadIdx.x == 0) counts.round = round;
    __syncthreads();
    solve<kBoundary>(step, team, space, counts, round == 0);
    if (team.rank() == 0) step.state.num_rounds += 1;
    team.barrier();
    is_done = reconcile<kBoundary>(step, team, counts, round);
  }
  if (!team.alone) return;
  // The first block did the last rounds alone.
  team.grid.sync();
  if (threadIdx.x == 0) counts.alone = 0;
  __syncthreads();
}

}  // namespace pf::cuda
