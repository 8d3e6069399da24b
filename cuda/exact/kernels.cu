#include "cuda/exact/kernels.cuh"

#include <algorithm>

#include "cuda/blocks.cuh"
#include "cuda/check.cuh"
#include "cuda/cuda_devices.hpp"
#include "cuda/exact/ball_rounds.cuh"
#include "cuda/exact/predict.cuh"
#include "cuda/exact/refresh.cuh"
#include "cuda/exact/solve_pair.cuh"
#include "cuda/exact/timeline.cuh"
#include "model/for_boundary.hpp"

namespace pf::cuda {
namespace {

constexpr unsigned kBlock = kExactBlock;
constexpr std::uint32_t kParcelsPerSlice = 1024;  // fewer blocks for few parcels: the barrier is cheaper

// ms at 10^7: 0.58; with 4 0.65; with 6 0.56, but slower below. In a periodic world registers spill with 5.
template <Boundary kBoundary>
constexpr unsigned kPredictBlocksPerSm = blocks_per_sm(kBoundary == Boundary::periodic ? 4 : 5, kBlock);
constexpr unsigned kPairBlocksPerSm = blocks_per_sm(4, kBlock);
// Blocks of solve_kernel on a multiprocessor. With one no registers spill, so that an event takes less time:
// worst frame of `bullet` of 10^6 408 ms instead of 512, of the court of 10^7 188 instead of 229. With two a
// gas of kManyParcels and more, which has thousands of clusters in a step, is 8 % faster (10^7 on an H200).
constexpr unsigned kFewBlocks = 1, kMoreBlocks = 2;
constexpr std::uint32_t kManyParcels = 4'000'000;
constexpr unsigned kMaxPartsOfSlice = 8;
// ms at 10^5, 10^6, 10^7: 0.012 0.031 0.20; with 1 0.015 0.038 0.21; with 4 0.022 0.063 0.30.
constexpr unsigned kLanesOfPair = 2;
// In a later window of a step a block has a dozen pairs, and the rest of the grid waits.
constexpr unsigned kLanesOfPairInWindow = 8;

// Several blocks share a slice in the kernels between which nothing is exchanged.
dim3 slice_parts(const StepMemory& memory) {
  return dim3(memory.num_slices, std::min(blocks_for(memory.active.capacity, kBlock), kMaxPartsOfSlice));
}
__device__ SlicePart part_of_block() { return {blockIdx.x, blockIdx.y, gridDim.y}; }

__device__ void draw_current(const ExactLaunch& launch, std::uint32_t i) {
  if (launch.draw.position_m == nullptr || i >= launch.space.num_parcels) return;
  const StepMemory& memory = launch.memory;
  draw_parcel(launch.draw, launch.run.physics.world, i, memory.positions[launch.state->current_buffer][i],
              memory.trajectories.velocity[i]);
}

template <Boundary kBoundary, bool kByRegion>
__global__ void __launch_bounds__(kBlock, kPredictBlocksPerSm<kBoundary>)
    predict_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ NearList<kBlock>::Space near_space;
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (is_over(launch)) {
    draw_current(launch, i);
    return;
  }
  const ExactConstants c = constants_of_step(launch);
  predict<kBoundary, true, kByRegion>({launch, c}, i, blockIdx.x % launch.memory.num_slices, near_space);
}

// Lies in the same place: nothing searches for neighbours while the ball's path is traced.
__device__ __forceinline__ PathHits& path_hits(NearList<kBlock>::Space& near) {
  static_assert(sizeof(PathHits) <= sizeof(near));
  return reinterpret_cast<PathHits&>(near);
}

template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kPairBlocksPerSm)
    pair_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ PairSpace pairs;
  __shared__ alignas(PathHits) NearList<kBlock>::Space near_space;
  if (is_over(launch)) return;
  const ExactConstants c = constants_of_window(launch);
  if (blockIdx.x == 0 && blockIdx.y == 0) expect_hits<kBoundary>({launch, c}, path_hits(near_space));
  solve_pairs<kBoundary, true, kLanesOfPair>({launch, c}, part_of_block(), pairs, near_space);
}

// ---- solve_kernel
//
// All blocks go through these states together. => is a barrier of the grid.
//
//   SOLVE    solve clusters => find conflicts => merge clusters => ... until there are no conflicts
//              solved up to `until`, where no anchoring is due: to_commit is set, return
//              otherwise: COMMIT
//   COMMIT   store the solution, unless the window failed => (predict what changed, if the step goes on =>)
//   END END      plan the next window, or a shorter one => START
//              or the step ends: time moves on => (anchor all =>) plan the next step
//                `until` is reached, or the window is unresolvable: return
//                a sort is due on the way: => return, the host launches the step again
//                otherwise: => START
//   START    predict all, or refresh kept events => form clusters, solve pairs => SOLVE
//
// A window that takes the step to `until` leaves COMMIT and END to commit_kernel, whose blocks need no
// barrier. In a gas every step is one such window; the loop is for crowds, retries, anchorings, and steps
// that end on the way.

struct SolveSpace {
  TallySlot tally;
  ClusterSpace clusters;
  SliceCounts counts;
  PairSpace pairs;
  alignas(PathHits) NearList<kBlock>::Space near;

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
  if (after == AfterWindow::stop) return false;
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
  if (state.paused != 0) return false;
  const bool is_done = state.progress.now >= launch.until;
  grid.sync();
  if (grid.thread_rank() == 0) {
    const std::uint64_t now = state.progress.now;
    if (!is_done) plan_next(launch, launch.until, chord_until(launch, now));
    if (is_done && launch.next_until > now) plan_next(launch, launch.next_until, launch.next_chord_end);
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
      for (std::uint32_t first = blockIdx.x * kBlock; first < launch.space.num_parcels;
           first += gridDim.x * kBlock)
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
__global__ void __launch_bounds__(kBlock, kBlocksPerSm)
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

// Returns whether this block is the last one of the grid to call it. All threads of the block call it.
__device__ bool is_last_block(std::uint32_t& num_arrived, bool& shared) {
  if (threadIdx.x == 0) {
    __threadfence();
    shared = atomicAdd(&num_arrived, 1U) == gridDim.x * gridDim.y - 1;
  }
  __syncthreads();
  if (shared) __threadfence();
  return shared;
}

// Commits what solve_kernel left to it. The last block ends the step and plans the next one.
template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock) commit_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ TallySlot tally;
  __shared__ bool is_last;
  ExactState& state = *launch.state;
  if (state.to_commit == 0) {
    // The step was over before solve_kernel, or in it. In the latter case the next one is planned already,
    // and planning it again changes nothing.
    if (is_over(launch) && state.paused == 0 && blockIdx.x == 0 && blockIdx.y == 0 && threadIdx.x == 0 &&
        launch.next_until > state.progress.now)
      plan_next(launch, launch.next_until, launch.next_chord_end);
    return;
  }
  const SlicePart part = part_of_block();
  if (threadIdx.x == 0) tally = {};
  __syncthreads();
  const ExactConstants c = constants_of_window(launch);
  commit<kBoundary>({launch, c}, part, launch.memory.counts[part.slice].members, false, tally);
  __syncthreads();
  if (threadIdx.x == 0) add_slot(launch.slots[(blockIdx.x + blockIdx.y) % kNumSlots], tally);
  if (!is_last_block(state.num_committed, is_last)) return;
  for (std::uint32_t s = threadIdx.x; s < gridDim.x; s += kBlock) launch.memory.counts[s] = {};
  if (threadIdx.x < kNumSlots) finish_window(launch, true);
  if (threadIdx.x != 0) return;
  state.to_commit = 0;
  state.num_committed = 0;
  if (launch.next_until > state.progress.now && state.paused == 0)
    plan_next(launch, launch.next_until, launch.next_chord_end);
}

__global__ void __launch_bounds__(kBlock) draw_paused_kernel(const __grid_constant__ ExactLaunch launch) {
  if (launch.state->paused != 0) draw_current(launch, blockIdx.x * kBlock + threadIdx.x);
}

template <unsigned kBlocksPerSm>
std::uint32_t max_slices() {
  int blocks = 0;
  int min_blocks = kBlocksPerSm;
  for (const auto kernel :
       {solve_kernel<Boundary::open, kBlocksPerSm>, solve_kernel<Boundary::walls, kBlocksPerSm>,
        solve_kernel<Boundary::periodic, kBlocksPerSm>}) {
    PF_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kBlock, 0));
    min_blocks = std::min(min_blocks, blocks);
  }
  return usable_multiprocessors() * static_cast<std::uint32_t>(min_blocks);
}

}  // namespace

std::uint32_t exact_num_slices(std::uint32_t num_parcels, bool has_ball) {
  const std::uint32_t wanted = (num_parcels + kParcelsPerSlice - 1) / kParcelsPerSlice;
  const std::uint32_t limit = device_limits().solver_blocks;
  const bool are_few = limit == 0 ? has_ball || num_parcels < kManyParcels : limit < kMoreBlocks;
  return std::clamp(wanted, 1U, std::max(1U, are_few ? max_slices<kFewBlocks>() : max_slices<kMoreBlocks>()));
}

void launch_predict(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    const auto kernel = launch.memory.region_speed2 == nullptr ? predict_kernel<kBoundary, false>
                                                               : predict_kernel<kBoundary, true>;
    kernel<<<blocks_for(launch.space.num_parcels, kBlock), kBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("predict_kernel");
}

void launch_solve(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    pair_kernel<kBoundary><<<slice_parts(launch.memory), kBlock, 0, stream>>>(launch);
    PF_LAUNCHED("pair_kernel");
    launch_first_round(launch, stream);
    ExactLaunch argument = launch;
    void* arguments[] = {&argument};
    const bool are_few = launch.memory.num_slices <= kFewBlocks * usable_multiprocessors();
    const auto kernel = are_few ? solve_kernel<kBoundary, kFewBlocks> : solve_kernel<kBoundary, kMoreBlocks>;
    PF_CUDA(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(kernel), dim3(launch.memory.num_slices),
                                        dim3(kBlock), arguments, 0, stream));
  });
}

void launch_draw_paused(const ExactLaunch& launch, cudaStream_t stream) {
  draw_paused_kernel<<<blocks_for(launch.space.num_parcels, kBlock), kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("draw_paused_kernel");
}

void launch_commit(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    commit_kernel<kBoundary><<<slice_parts(launch.memory), kBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("commit_kernel");
}

}  // namespace pf::cuda
