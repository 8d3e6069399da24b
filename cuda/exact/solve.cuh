// Method `exact` on the device, third stage of a step: solving the clusters that are not solved as pairs.
#pragma once

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
  // Rank of the warp in its first thread, and more than any number of items in the others: work that mostly
  // waits for memory is no faster with more threads.
  __device__ unsigned warp_rank() const { return threadIdx.x % 32 == 0 ? rank() / 32 : kInvalidIndex; }
  __device__ unsigned num_warps() const { return num_threads() / 32; }
  __device__ unsigned block() const { return alone ? 0U : blockIdx.x; }
  __device__ unsigned num_blocks() const { return alone ? 1U : gridDim.x; }
};

__device__ inline bool needs_block(const StepContext& step, std::uint32_t cluster) {
  return cluster_of(step, cluster).needs_block != 0;
}

// Solves the clusters in `todo` that take a block each.
template <Boundary kBoundary>
__device__ __forceinline__ void solve_by_blocks(const StepContext& step, const StepTeam& team,
                                                BlockSpace& space, BlockCounts& counts) {
  BlockSolver<kBoundary> solver(step, space, counts);
  const std::uint32_t num = load_fresh(&step.state.num_todo);
  for (std::uint32_t k = team.block(); k < num; k += team.num_blocks()) {
    const std::uint32_t cluster = step.memory.todo.items[k];
    if (needs_block(step, cluster)) solver.solve(cluster, cluster_of(step, cluster).merged);
  }
}

// Solves the other clusters: in the first round those that were formed, later those that were merged.
template <Boundary kBoundary>
__device__ __forceinline__ void solve_by_warps(const StepContext& step, const StepTeam& team,
                                               WarpSpace& space, BlockCounts& counts, bool is_first) {
  constexpr unsigned kWarps = kExactBlock / 32;
  ExactState& state = step.state;
  const StepMemory& memory = step.memory;
  WarpSolver<kBoundary> solver(step, space, counts);
  const std::uint32_t num_warps = team.num_blocks() * kWarps;
  const std::uint32_t num = load_fresh(is_first ? &state.num_representatives : &state.num_todo);
  const auto after = [&](std::uint32_t k) {
    if (!is_first || num <= num_warps) return k + num_warps;
    std::uint32_t number = 0;
    if (threadIdx.x % 32 == 0) number = atomicAdd(&state.num_taken, 1U);
    return num_warps + __shfl_sync(kWholeWarp, number, 0);
  };
  for (std::uint32_t k = team.block() + team.num_blocks() * (threadIdx.x / 32); k < num; k = after(k)) {
    const std::uint32_t cluster = is_first ? memory.representatives.items[k] : memory.todo.items[k];
    if (is_first || !needs_block(step, cluster))
      solver.solve(cluster, is_first ? memory.list_head[cluster] : cluster_of(step, cluster).merged);
  }
}

// Shared memory of a block.
struct ClusterSpace {
  BlockSpace block;
  WarpSpace warps;
};

template <Boundary kBoundary>
__device__ __forceinline__ void solve(const StepContext& step, const StepTeam& team, ClusterSpace& space,
                                      BlockCounts& counts, bool is_first) {
  if (!is_first) solve_by_blocks<kBoundary>(step, team, space.block, counts);
  __syncthreads();
  solve_by_warps<kBoundary>(step, team, space.warps, counts, is_first);
}

}  // namespace pf::cuda
