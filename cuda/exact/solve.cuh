// Method `exact` on the device, third stage of a step: solving the clusters that are not solved as pairs.
#pragma once

#include <cooperative_groups.h>

#include "cuda/exact/solve_block.cuh"
#include "cuda/exact/solve_warp.cuh"

namespace pf::cuda {

namespace cg = cooperative_groups;

// The blocks that work on a step: all of solve_kernel, or the first one alone.
struct StepTeam {
  cg::grid_group grid = cg::this_grid();
  bool alone = false;

  __device__ void barrier() const {
    if (alone) {
      __syncthreads();
    } else {
      grid.sync();
    }
  }
  __device__ unsigned rank() const { return alone ? threadIdx.x : static_cast<unsigned>(grid.thread_rank()); }
  __device__ unsigned num_threads() const { return alone ? kExactBlock : static_cast<unsigned>(grid.size()); }
  // A rank by which consecutive threads lie in different warps: few items, on different ways through the
  // code, do not wait for each other.
  __device__ unsigned spread_rank() const { return threadIdx.x % 32 * num_warps() + rank() / 32; }
  // Rank of the warp in its first thread, and more than any number of items in the others: work that mostly
  // waits for memory is no faster with more threads.
  __device__ unsigned leader_rank() const { return threadIdx.x % 32 == 0 ? rank() / 32 : kInvalidIndex; }
  __device__ unsigned num_warps() const { return num_threads() / 32; }
  __device__ unsigned block() const { return alone ? 0U : blockIdx.x; }
  __device__ unsigned num_blocks() const { return alone ? 1U : gridDim.x; }
};

// With more clusters for each block warps solve them.
constexpr std::uint32_t kClustersOfBlock = 2;

// The clusters to solve: in the first round those that were formed, later those that were merged.
struct ClustersToSolve {
  const StepContext& step;
  bool is_first;
  std::uint32_t num;
  bool are_few;  // blocks solve them
  // The ball's cluster, if it is formed now, or kInvalidIndex; and of each lane one of those it is formed of.
  std::uint32_t ball_owner = kInvalidIndex, part_of_ball_owner = kInvalidIndex;

  __device__ __forceinline__ ClustersToSolve(const StepContext& context, unsigned num_blocks, bool first)
      : step(context),
        is_first(first),
        num(load_fresh(first ? &context.state.num_representatives : &context.state.num_todo)),
        are_few(num <= kClustersOfBlock * num_blocks) {
    const ExactState& state = context.state;
    if (!first || !ball_joins(context) || state.num_ball_hits == 0) return;
    ball_owner = state.ball_owner;
    const unsigned lane = threadIdx.x % 32;
    if (lane < state.num_ball_hits) part_of_ball_owner = context.memory.ball_hits[lane].cluster;
  }

  __device__ __forceinline__ std::uint32_t operator[](std::uint32_t k) const {
    return is_first ? step.memory.representatives.items[k] : step.memory.todo.items[k];
  }
  __device__ __forceinline__ std::uint32_t list_of(std::uint32_t cluster) const {
    return is_first ? step.memory.list_head[cluster] : cluster_of(step, cluster).merged;
  }
  __device__ __forceinline__ bool takes_block(std::uint32_t cluster) const {
    return are_few || (is_first ? cluster == ball_owner : cluster_of(step, cluster).needs_block != 0);
  }
  // Returns whether it is solved as a part of the ball's cluster. Whole warps call it.
  __device__ __forceinline__ bool is_part(std::uint32_t cluster) const {
    return ball_owner != kInvalidIndex && cluster != ball_owner &&
           __any_sync(kWholeWarp, part_of_ball_owner == cluster) != 0;
  }
};

template <Boundary kBoundary>
__device__ __forceinline__ void solve_by_blocks(const StepContext& step, const StepTeam& team,
                                                const ClustersToSolve& clusters, BlockSpace& space,
                                                SliceCounts& counts) {
  const auto has_ball = [&](std::uint32_t cluster) {
    return ball_joins(step) && owner_of_ball(step) == cluster;
  };
  for (std::uint32_t k = team.block(); k < clusters.num; k += team.num_blocks()) {
    const std::uint32_t cluster = clusters[k];
    if (!clusters.takes_block(cluster) || clusters.is_part(cluster)) continue;
    std::uint32_t list = clusters.list_of(cluster);
    bool with_ball = __syncthreads_or(has_ball(cluster)) != 0;
    if (!with_ball) with_ball = BlockSolver<kBoundary, false>(step, space, counts).solve(cluster, list);
    if (with_ball) BlockSolver<kBoundary, true>(step, space, counts).solve(cluster, list);
  }
}

// A block's place among those that solve clusters.
struct BlockRank {
  std::uint32_t rank, num_blocks;
};

template <Boundary kBoundary>
__device__ __forceinline__ void solve_by_warps(const StepContext& step, const BlockRank& block,
                                               const ClustersToSolve& clusters, WarpSpace& space,
                                               SliceCounts& counts) {
  WarpSolver<kBoundary> solver(step, space, counts);
  const std::uint32_t num_warps = block.num_blocks * (kExactBlock / 32);
  const auto after = [&](std::uint32_t k) {
    if (!clusters.is_first || clusters.num <= num_warps) return k + num_warps;
    std::uint32_t number = 0;
    if (threadIdx.x % 32 == 0) number = atomicAdd(&step.state.num_taken, 1U);
    return num_warps + __shfl_sync(kWholeWarp, number, 0);
  };
  for (std::uint32_t k = block.rank + block.num_blocks * (threadIdx.x / 32); k < clusters.num; k = after(k)) {
    const std::uint32_t cluster = clusters[k];
    if (!clusters.takes_block(cluster) && !clusters.is_part(cluster))
      solver.solve(cluster, clusters.list_of(cluster));
  }
}

// Shared memory of a block.
struct ClusterSpace {
  BlockSpace block;
  // In the same place: warps solve clusters after the block.
  __device__ __forceinline__ WarpSpace& warps() { return reinterpret_cast<WarpSpace&>(block); }
};
static_assert(sizeof(WarpSpace) <= sizeof(BlockSpace) && alignof(WarpSpace) <= alignof(BlockSpace));

template <Boundary kBoundary>
__device__ __forceinline__ void solve(const StepContext& step, const StepTeam& team, ClusterSpace& space,
                                      SliceCounts& counts, bool is_first) {
  const ClustersToSolve clusters(step, team.num_blocks(), is_first);
  if (clusters.are_few || !is_first || clusters.ball_owner != kInvalidIndex)
    solve_by_blocks<kBoundary>(step, team, clusters, space.block, counts);
  __syncthreads();
  const bool are_done = is_first && step.state.first_round_is_done != 0;
  if (!clusters.are_few && !are_done)
    solve_by_warps<kBoundary>(step, {team.block(), team.num_blocks()}, clusters, space.warps(), counts);
}

}  // namespace pf::cuda
