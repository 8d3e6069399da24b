// Method `exact` on the device: from the clusters of exact_pairs.cuh to clusters that fit together. The
// blocks of a cooperative kernel solve, compare and merge them; backend/exact_stepper.cpp has the same.
#pragma once

#include "cuda/exact/solve_block.cuh"
#include "cuda/exact/solve_warp.cuh"

namespace pf {

// With at most so many conflicts left, one block solves the rest alone: its barrier costs a tenth.
constexpr std::uint32_t kAlone = 8;

// What one block's threads know of solving the step's clusters.
template <Boundary kBoundary>
struct Clusters {
  const ExactLaunch& launch;
  const ExactConstants& c;
  ExactState& state;
  BlockSpace& space;
  BlockCounts& counts;
  const ExactArrays& a = launch.arrays;
  cg::grid_group grid = cg::this_grid();
  bool alone = false;  // one block, which does what is left

  __device__ void barrier() {
    if (alone) {
      __syncthreads();
    } else {
      grid.sync();
    }
  }
  __device__ unsigned rank() const { return alone ? threadIdx.x : static_cast<unsigned>(grid.thread_rank()); }
  // The warp's rank for its first thread, for the others beyond any count: work that mostly waits for memory
  // is no faster with more.
  __device__ unsigned lone_rank() const { return threadIdx.x % 32 == 0 ? rank() / 32 : kInvalidIndex; }
  __device__ unsigned num_threads() const { return alone ? kExactBlock : static_cast<unsigned>(grid.size()); }
  __device__ unsigned block() const { return alone ? 0U : blockIdx.x; }
  __device__ unsigned num_blocks() const { return alone ? 1U : gridDim.x; }
  template <class T>
  __device__ T* slice(T* items, std::uint32_t capacity) const {
    return items + static_cast<std::size_t>(blockIdx.x) * capacity;
  }
  __device__ static std::uint32_t at_most(std::uint32_t count, std::uint32_t capacity) {
    return count < capacity ? count : capacity;
  }

  __device__ bool is_for_block(std::uint32_t cluster) const {
    return record_of(a, cluster).wants_block != 0 || load_fresh(&state.ball_owner) == cluster;
  }

  // In the first round the clusters that were formed, and the ball's; later those that were merged.
  __device__ void solve(bool is_first) {
    solve_large(is_first);
    __syncthreads();
    constexpr unsigned kWarps = kExactBlock / 32;
    WarpSolver<kBoundary> solver(launch, c, state, counts);
    const std::uint32_t num_warps = num_blocks() * kWarps;
    const std::uint32_t num = load_fresh(is_first ? &state.num_representatives : &state.num_todo);
    const auto after = [&](std::uint32_t k) {
      if (!is_first || num <= num_warps) return k + num_warps;
      std::uint32_t number = 0;
      if (threadIdx.x % 32 == 0) number = atomicAdd(&state.num_begun, 1U);
      return num_warps + __shfl_sync(kWholeWarp, number, 0);
    };
    for (std::uint32_t k = block() + num_blocks() * (threadIdx.x / 32); k < num; k = after(k)) {
      const std::uint32_t cluster = is_first ? a.representatives.items[k] : a.todo.items[k];
      if (is_first || !is_for_block(cluster))
        solver.solve(cluster, is_first ? a.list_head[cluster] : record_of(a, cluster).merged);
    }
  }

  // Of those the ones that a block solves.
  __device__ void solve_large(bool is_first) {
    BlockSolver<kBoundary> solver(launch, c, state, space, counts);
    const bool has_ball = blockIdx.x == 0 && c.plan.ball == BallRole::participant;
    const std::uint32_t num = is_first ? (has_ball ? 1U : 0U) : load_fresh(&state.num_todo);
    for (std::uint32_t k = is_first ? 0U : block(); k < num; k += num_blocks()) {
      const std::uint32_t cluster = is_first ? kBallCluster : a.todo.items[k];
      if (is_first || is_for_block(cluster))
        solver.solve(cluster, is_first ? kInvalidIndex : record_of(a, cluster).merged);
    }
  }

  // visit(line, end) for the lines that events of the step led a parcel to, until it returns true.
  template <class Visit>
  __device__ bool any_segment(std::uint32_t i, Visit visit) const {
    const ClusterMember& member = a.members[a.member_slot[i]];
    if (!member.has_changed) return false;
    if (!is_retired(member.trajectory.anchor) && visit(member.trajectory, c.plan.length)) return true;
    for (std::uint32_t s = member.segments; s != kInvalidIndex; s = a.segments[s].before) {
      if (visit(a.segments[s].trajectory, a.segments[s].end)) return true;
    }
    return false;
  }

  __device__ static bool is_within(std::uint32_t tick, std::uint32_t one_end, std::uint32_t other_end) {
    return tick != kNoTick && tick <= (one_end < other_end ? one_end : other_end);
  }

  __device__ bool trajectories_collide(std::uint32_t i, std::uint32_t j) const {
    return any_segment(i, [&](const Trajectory& p, std::uint32_t p_end) {
      return any_segment(j, [&](const Trajectory& q, std::uint32_t q_end) {
        return is_within(collision_tick<kBoundary>(c, p, q), p_end, q_end);
      });
    });
  }

  __device__ bool collides_with_ball(std::uint32_t i) const {
    return any_segment(i, [&](const Trajectory& trajectory, std::uint32_t end) {
      if (is_within(ball_collision_tick<kBoundary>(c, state.ball_now.trajectory, trajectory), end, c.plan.length)) return true;
      for (std::uint32_t s = 0; s < state.num_ball_segments; ++s) {
        const BallTrajectorySegment slice = a.ball_segments[s];
        if (is_within(ball_collision_tick<kBoundary>(c, slice.trajectory, trajectory), end, slice.end)) return true;
      }
      return false;
    });
  }

  // Finds the clusters whose new lines would have met.
  __device__ void find_conflicts() {
    const std::uint32_t num = at_most(counts.neighbour_pairs, a.neighbour_pair_capacity);
    for (std::uint32_t k = threadIdx.x; k < num; k += kExactBlock) {
      const uint2 pair = slice(a.neighbour_pairs, a.neighbour_pair_capacity)[k];
      const std::uint32_t p = a.owner[pair.x], q = a.owner[pair.y];
      if (p != q && record_of(a, p).is_solved && record_of(a, q).is_solved && trajectories_collide(pair.x, pair.y))
        add_conflict(a, counts, state, p, q);
    }
    __syncthreads();
    if (threadIdx.x == 0) counts.neighbour_pairs = 0;
    if (c.plan.ball != BallRole::participant || !state.ball_has_changed) return;
    const std::uint32_t with_ball = state.ball_owner;
    if (!record_of(a, with_ball).is_solved) return;
    for (std::uint32_t k = rank(); k < at_most(state.num_near_ball, a.near_ball.capacity);
         k += num_threads()) {
      const std::uint32_t i = a.near_ball.items[k], owner = a.owner[i];
      if (owner != kInvalidIndex && owner != with_ball && record_of(a, owner).is_solved && collides_with_ball(i))
        add_conflict(a, counts, state, with_ball, owner);
    }
  }

  // Gives the cluster's members to the root of its set.
  __device__ void reassign_members(std::uint32_t cluster, std::uint32_t round) {
    ClusterRecord& record = record_of(a, cluster);
    if (atomicExch(&record.claimed, round) == round) return;
    record.is_solved = 0;
    const std::uint32_t root = find_root(a, cluster);
    ClusterRecord& into = record_of(a, root);
    std::uint32_t last = kInvalidIndex;
    for (std::uint32_t m = record.members; m != kInvalidIndex; m = a.members[m].next) {
      a.owner[a.members[m].index] = root;
      last = m;
    }
    if (last != kInvalidIndex) a.members[last].next = atomicExch(&into.merged, record.members);
    if (record.wants_block) into.wants_block = 1;
    if (state.ball_owner == cluster && root != cluster) state.ball_owner = root;
    if (root != cluster) return;
    a.todo.items[atomicAdd(&state.num_todo, 1U)] = root;  // they are no more than the conflicts
  }

  // Solves all clusters. Returns whether the first block did the last rounds alone: the others are back
  // before it, and all must then wait for it.
  __device__ bool run() {
    for (std::uint32_t round = 0;; ++round) {
      solve(round == 0);
      if (rank() == 0) state.num_rounds += 1;
      barrier();
      if (rank() == 0) state.num_todo = 0;
      find_conflicts();
      barrier();
      // What a block reads here must not depend on how late it comes: once the first one is alone, it changes
      // `failed`, but not the first of the numbers.
      const std::uint32_t num = load_fresh(&state.num_conflicts[alone ? 1 : 0]);
      if (num == 0) return alone;
      if (!alone && num <= kAlone) {
        if (blockIdx.x != 0) return true;
        alone = true;
        if (threadIdx.x == 0) counts.alone = 1;
      }
      if (load_fresh(&state.solve_failed) != 0) return alone;
      for (std::uint32_t k = lone_rank(); k < num; k += num_threads() / 32)
        union_sets(a, holder_of(a, a.conflicts[k].x), holder_of(a, a.conflicts[k].y));
      barrier();
      if (rank() == 0) state.num_conflicts[alone ? 1 : 0] = 0;
      for (std::uint32_t k = lone_rank(); k < 2 * num; k += num_threads() / 32) {
        const uint2 pair = a.conflicts[k / 2];
        reassign_members(holder_of(a, k % 2 == 0 ? pair.x : pair.y), round);
      }
      barrier();
    }
  }
};

}  // namespace pf
