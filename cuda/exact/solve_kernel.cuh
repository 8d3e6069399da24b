// solve_kernel: it solves the windows of a step, one after the other.
//
// All blocks go through these states together. => is a barrier of the grid.
//
//   SOLVE    solve clusters => find conflicts => merge clusters => ... until there are no conflicts
//              solved up to `until`, where no anchoring is due: to_commit is set, return
//              otherwise: COMMIT
//   COMMIT   store the solution, unless the window failed => (predict what changed, if the step goes on =>)
//   END      plan the next window, or a shorter one => START
//              or the step ends: time moves on => (anchor all =>) plan the next step
//                `until` is reached, or the window is unresolvable: return
//                a sort is due on the way: => return, the host launches the step again
//                otherwise: => START
//   START    predict all, or refresh kept events => form clusters, solve pairs => SOLVE
//
// A window that takes the step to `until` leaves COMMIT and END to commit_kernel, whose blocks need no
// barrier. In a gas every step is one such window; the loop is for crowds, retries, anchorings, and steps
// that end on the way.
#pragma once

#include "cuda/exact/ball_rounds.cuh"
#include "cuda/exact/refresh.cuh"
#include "cuda/exact/solve_pair.cuh"
#include "cuda/exact/timeline.cuh"

namespace pf::cuda {

// In a later window of a step a block has a dozen pairs, and the rest of the grid waits.
constexpr unsigned kLanesOfPairInWindow = 8;

struct SolveSpace {
  TallySlot tally;
  ClusterSpace clusters;
  SliceCounts counts;
  PairSpace pairs;
  alignas(PathHits) NearList<kExactBlock>::Space near;

  // In the same place: no cluster is solved while tiles are refreshed.
  __device__ __forceinline__ DueTiles& due_tiles() { return reinterpret_cast<DueTiles&>(clusters); }
};
static_assert(sizeof(DueTiles) <= sizeof(ClusterSpace));
static_assert(sizeof(SolveSpace) <= 48 * 1024);  // of shared memory, on any architecture

// State SOLVE. Returns whether the window is solved.
template <Boundary kBoundary>
__device__ __forceinline__ bool run_solve(const StepContext& step, SolveSpace& space) {
  if (threadIdx.x == 0) space.counts = step.memory.counts[blockIdx.x];
  __syncthreads();
  const bool can_start = step.state.list_overflow == 0 && step.state.near_ball_overflow == 0;
  if (can_start) solve_all<kBoundary>(step, space.clusters, path_hits(space.near), space.counts);
  return is_solved(step.state);
}

// State COMMIT. Returns whether the window is over: if the step goes on, the first warp of all ends it while
// others predict, for which nothing matters that changes then.
template <Boundary kBoundary>
__device__ __forceinline__ bool run_commit(const StepContext& step, SolveSpace& space, bool solved) {
  SliceCounts& counts = step.memory.counts[blockIdx.x];
  const std::uint32_t num_members = min(space.counts.members, step.memory.member_capacity);
  if (threadIdx.x == 0) counts.members = num_members;
  const bool goes_on = step.state.window_end < step.state.plan.length;
  if (solved) commit<kBoundary>(step, {blockIdx.x}, num_members, goes_on, space.tally);
  if (solved && goes_on) {
    cg::this_grid().sync();
    const ExactConstants c = constants_of_step(step.launch);
    if (blockIdx.x == 0 && threadIdx.x / 32 == 0) {
      finish_window(step.launch, true);
    } else {
      predict_members<kBoundary>({step.launch, c}, space.near);
    }
  }
  __syncthreads();
  if (threadIdx.x == 0) {
    add_slot(step.launch.slots[blockIdx.x % kNumSlots], space.tally);
    space.tally = {};
  }
  cg::this_grid().sync();
  if (threadIdx.x == 0) counts = {};
  __syncthreads();
  return solved && goes_on;
}

// State END. has_ended: the window has been ended. Returns whether the kernel goes on with another window.
template <Boundary kBoundary>
__device__ __forceinline__ bool run_end(const ExactLaunch& launch, bool solved, bool has_ended,
                                        AfterWindow& after) {
  const cg::grid_group grid = cg::this_grid();
  const auto rank = static_cast<std::uint32_t>(grid.thread_rank());
  const auto num_threads = static_cast<std::uint32_t>(grid.size());
  const bool is_first_warp = rank < kNumSlots;
  ExactState& state = *launch.state;
  if (!has_ended) {
    if (is_first_warp) finish_window(launch, solved);
    grid.sync();
  }
  after = state.after_window;
  if (after == AfterWindow::next_window) return true;
  if (after == AfterWindow::retry_window) {
    release_all(launch, rank, num_threads);
    grid.sync();
    return true;
  }
  if (after == AfterWindow::end_step_here) {
    locate_all<kBoundary>(launch, rank, num_threads);
    grid.sync();
    if (is_first_warp) finish_step(launch, true);
    grid.sync();
  }
  if (after != AfterWindow::retry_step && is_at_anchoring(state.progress))
    anchor_all(launch, rank, num_threads, [&] { grid.sync(); });
  if (state.paused != 0 || state.unresolvable != 0) return false;
  const bool is_done = state.progress.now >= launch.until;
  grid.sync();
  if (grid.thread_rank() == 0) {
    const std::uint64_t now = state.progress.now;
    if (!is_done) plan_next(launch, launch.until, launch.chord_ends);
    if (is_done && launch.next_until > now) plan_next(launch, launch.next_until, launch.next_chord_ends);
  }
  if (is_done) return false;
  grid.sync();
  return launch.sort_displacement == 0 || state.progress.max_displacement <= launch.sort_displacement;
}

// State START.
template <Boundary kBoundary>
__device__ __forceinline__ void run_start(const ExactLaunch& launch, bool same_step, SolveSpace& space) {
  {
    const ExactConstants c = constants_of_step(launch);
    const StepContext step{launch, c};
    if (same_step) {
      refresh<kBoundary>(step, space.due_tiles(), space.near);
    } else {
      for (std::uint32_t first = blockIdx.x * kExactBlock; first < launch.space.num_parcels;
           first += gridDim.x * kExactBlock)
        predict<kBoundary, false, true>(step, first + threadIdx.x, blockIdx.x, space.near);
    }
  }
  cg::this_grid().sync();
  const ExactConstants c = constants_of_window(launch);
  if (blockIdx.x == 0) expect_hits<kBoundary>({launch, c}, path_hits(space.near));
  solve_pairs<kBoundary, false, kLanesOfPairInWindow>({launch, c}, {blockIdx.x}, space.pairs, space.near);
  cg::this_grid().sync();
}

template <Boundary kBoundary, unsigned kBlocksPerSm>
__global__ void __launch_bounds__(kExactBlock, kBlocksPerSm)
    solve_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ SolveSpace space;
  if (is_over(launch)) return;
  if (threadIdx.x == 0) space.tally = {};
  while (true) {
    const ExactConstants c = constants_of_window(launch);
    const StepContext step{launch, c};
    const bool solved = run_solve<kBoundary>(step, space);
    const bool ends_step = step.state.window_end == step.state.plan.length;
    if (solved && ends_step && reaches_end(step) && !ends_at_anchoring(step)) {
      if (threadIdx.x == 0)
        launch.memory.counts[blockIdx.x].members = min(space.counts.members, launch.memory.member_capacity);
      if (blockIdx.x == 0 && threadIdx.x == 0) step.state.to_commit = 1;
      return;
    }
    const bool has_ended = run_commit<kBoundary>(step, space, solved);
    AfterWindow after;
    if (!run_end<kBoundary>(launch, solved, has_ended, after)) return;
    const bool same_step = after == AfterWindow::next_window || after == AfterWindow::retry_window;
    run_start<kBoundary>(launch, same_step, space);
  }
}

template <Boundary kBoundary>
SolveKernel solve_kernel_of(bool are_few) {
  return are_few ? solve_kernel<kBoundary, kFewBlocks> : solve_kernel<kBoundary, kMoreBlocks>;
}

}  // namespace pf::cuda
