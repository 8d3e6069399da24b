#include "cuda/exact/step_state.cuh"

#include <algorithm>

#include "cuda/architecture.cuh"
#include "cuda/check.cuh"
#include "cuda/cuda_devices.hpp"
#include "cuda/exact/reconcile.cuh"
#include "cuda/exact/commit.cuh"
#include "cuda/exact/solve_pair.cuh"
#include "cuda/exact/predict.cuh"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

constexpr unsigned kBlock = kExactBlock;
constexpr std::uint32_t kParcelsPerSlice = 1024;  // fewer blocks for few parcels: the barrier is cheaper

// ms at 10^7: 0.58; with 4 0.65, with 6 0.56, but slower below; in a periodic world registers spill with 5.
template <Boundary kBoundary>
constexpr unsigned kPredictBlocksPerSm = blocks_per_sm(kBoundary == Boundary::periodic ? 4 : 5, kBlock);
constexpr unsigned kSolveBlocksPerSm = 2;  // with 3, registers spill: 0.23 ms at 10^7 for 0.21
constexpr unsigned kMaxPartsOfSlice = 8;
// ms at 10^5, 10^6, 10^7: 0.012 0.031 0.20; with 1 0.015 0.038 0.21; with 4 0.022 0.063 0.30
constexpr unsigned kLanesOfPair = 2;

unsigned blocks_for(std::uint32_t n) { return (n + kBlock - 1) / kBlock; }

// Whether there is nothing to do: a coarse tick led beyond the end of the step.
__device__ bool is_over(const ExactLaunch& launch) {
  return launch.state->progress.now >= launch.until || launch.state->unresolvable != 0;
}

__device__ void draw_present(const ExactLaunch& launch, std::uint32_t i) {
  if (launch.draw.position_m == nullptr || i >= launch.space.num_parcels) return;
  const ExactArrays& a = launch.arrays;
  draw_parcel(launch.draw, launch.run.physics.world, i, a.present[launch.state->current_buffer][i],
              a.trajectories.velocity[i]);
}

template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kPredictBlocksPerSm<kBoundary>)
    predict_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ NearList<kBlock>::Space near_space;
  if (is_over(launch)) {
    draw_present(launch, blockIdx.x * kBlock + threadIdx.x);
    return;
  }
  predict_one<kBoundary, true>(constants_of(launch), launch, blockIdx.x * kBlock + threadIdx.x,
                               blockIdx.x % launch.arrays.num_slices, near_space);
}

// blockIdx.x: segment; blockIdx.y: a part of it.
template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock) pair_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ PairSpace space;
  __shared__ NearList<kBlock>::Space near_space;
  if (is_over(launch)) return;
  solve_pairs<kBoundary, true, kLanesOfPair>(constants_of(launch), launch, blockIdx.x, blockIdx.y, gridDim.y,
                                             space, near_space);
}

// Solves the clusters of one step. If it must be redone, or is only a part of the way to `until`, also what
// follows, but for the last commit, which is commit_kernel's.
template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kSolveBlocksPerSm)
    solve_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ TallySlot block_tally;
  __shared__ BlockSpace space;
  __shared__ BlockCounts counts;
  __shared__ PairSpace pair_space;
  __shared__ NearList<kBlock>::Space near_space;
  cg::grid_group grid = cg::this_grid();
  ExactState& state = *launch.state;
  SliceCounts& outside = launch.arrays.counts[blockIdx.x];
  if (is_over(launch)) return;
  if (threadIdx.x == 0) block_tally = {};
  while (true) {
    const ExactConstants c = constants_of(launch);
    if (threadIdx.x == 0) {
      counts = {};
      counts.members = min(outside.active, launch.arrays.active.capacity);
      counts.neighbour_pairs = outside.neighbour_pairs;
    }
    __syncthreads();
    Clusters<kBoundary> clusters{launch, c, state, space, counts};
    const bool one_was_alone = state.list_overflow == 0 && clusters.run();
    if (one_was_alone) grid.sync();
    const bool finished = is_solved(state);
    const std::uint32_t num_members = min(counts.members, launch.arrays.member_capacity);
    if (finished && reaches_end(state, launch.until) && !ends_at_anchoring(state)) {
      if (threadIdx.x == 0) outside.members = num_members;
      if (grid.thread_rank() == 0) state.to_commit = 1;
      return;
    }
    if (finished) {
      commit<kBoundary>(c, launch, state, blockIdx.x, num_members, threadIdx.x, kBlock, block_tally);
    }
    __syncthreads();
    if (threadIdx.x == 0) {
      add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
      block_tally = {};
      outside = {};
    }
    grid.sync();
    if (blockIdx.x == 0 && threadIdx.x < kNumSlots) finish_step_on_device(launch, finished);
    grid.sync();
    if (load_fresh(&state.unresolvable) != 0) return;
    if (finished && is_at_anchoring(state.progress))
      anchor_all(launch, static_cast<std::uint32_t>(grid.thread_rank()),
                 static_cast<std::uint32_t>(grid.size()), [&] { grid.sync(); });
    const bool done = state.progress.now >= launch.until;
    grid.sync();
    if (grid.thread_rank() == 0) {
      const std::uint64_t until = done ? launch.next_until : launch.until;
      if (until > state.progress.now) plan_next(launch.run, until, state);
    }
    if (done) return;
    grid.sync();
    if (launch.farthest > 0 && state.progress.max_displacement > launch.farthest) return;
    const ExactConstants next = constants_of(launch);
    for (std::uint32_t tile = blockIdx.x; tile * kBlock < launch.space.num_parcels; tile += gridDim.x)
      predict_one<kBoundary, false>(next, launch, tile * kBlock + threadIdx.x, blockIdx.x, near_space);
    grid.sync();
    solve_pairs<kBoundary, false, kLanesOfPair>(next, launch, blockIdx.x, 0, 1, pair_space, near_space);
    grid.sync();
  }
}

// Commits what solve_kernel solved, and plans the next step. blockIdx.x: segment; blockIdx.y: a part of it.
template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock) commit_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ TallySlot block_tally;
  __shared__ bool is_last;
  ExactState& state = *launch.state;
  if (state.to_commit == 0) {  // solve_kernel did all; planned anew, which changes nothing, if it had not
    if (is_over(launch) && blockIdx.x == 0 && blockIdx.y == 0 && threadIdx.x == 0 &&
        launch.next_until > state.progress.now)
      plan_next(launch.run, launch.next_until, state);
    return;
  }
  const std::uint32_t slice = blockIdx.x;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  commit<kBoundary>(constants_of(launch), launch, state, slice, launch.arrays.counts[slice].members,
                    blockIdx.y * kBlock + threadIdx.x, gridDim.y * kBlock, block_tally);
  __syncthreads();
  if (threadIdx.x == 0) {
    add_slot(launch.slots[(blockIdx.x + blockIdx.y) % kNumSlots], block_tally);
    __threadfence();
    const std::uint32_t num_blocks = gridDim.x * gridDim.y;
    is_last = atomicAdd(&state.num_committed, 1U) == num_blocks - 1;
  }
  __syncthreads();
  if (!is_last) return;
  __threadfence();
  for (std::uint32_t s = threadIdx.x; s < gridDim.x; s += kBlock) launch.arrays.counts[s] = {};
  if (threadIdx.x < kNumSlots) finish_step_on_device(launch, true);
  if (threadIdx.x != 0) return;
  state.to_commit = 0;
  state.num_committed = 0;
  if (launch.next_until > state.progress.now) plan_next(launch.run, launch.next_until, state);
}

__global__ void begin_request_kernel(const __grid_constant__ ExactLaunch launch) {
  ExactState& state = *launch.state;
  if (threadIdx.x < kNumSlots) launch.slots[threadIdx.x] = {};
  for (std::uint32_t s = threadIdx.x; s < launch.arrays.num_slices; s += blockDim.x)
    launch.arrays.counts[s] = {};
  if (threadIdx.x == 0) {
    launch.step_state->totals = {};
    state.num_rounds = 0;
    state.num_retried = 0;
    state.event_hash = 0;
    state.unresolvable = 0;
    state.progress.ball = launch.step_state->ball;
    if (launch.ball_was_set) state.progress.ball_trajectory_holds = false;
  }
  __syncthreads();
  if (launch.ball_was_set && state.progress.tick_exponent != 0 && launch.run.physics.ball.exists &&
      surface_speed_mps(launch.run.physics, state.progress.ball) >
          tick_speed_mps(launch.run.reference_ticks, state.progress.tick_exponent))
    anchor_all(launch, threadIdx.x, blockDim.x, [] { __syncthreads(); });
  __syncthreads();
  if (threadIdx.x != 0) return;
  state.max_ticks = static_cast<std::uint32_t>(kAnchorPeriod);
  if (launch.until > state.progress.now) plan_next(launch.run, launch.until, state);
}

__global__ void enter_kernel(const __grid_constant__ ExactLaunch launch, std::uint64_t now) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  const ExactArrays& a = launch.arrays;
  float speed2 = 0.0F;
  if (i < launch.space.num_parcels) {
    a.trajectories.tick[i] = static_cast<std::uint32_t>(now);
    if (a.trajectories.last_contact_tick) a.trajectories.last_contact_tick[i] = static_cast<std::uint32_t>(now - kAnchorPeriod);
    a.present[0][i] = a.trajectories.position[i];
    const float any_speed2 = dot(a.trajectories.velocity[i], a.trajectories.velocity[i]);
    if (!is_retired(a.trajectories.position[i]) && any_speed2 < 1e30F) speed2 = any_speed2;
  }
  const unsigned fastest = warp_max(__float_as_uint(speed2));
  if (threadIdx.x % 32 == 0) atomicMax(&launch.state->fastest_after_bits, fastest);
}

__global__ void enter_state_kernel(ExactState* state, std::uint64_t now) {
  *state = {};
  state->progress.now = now;
}

__global__ void enter_done_kernel(ExactState* state) {
  state->progress.fastest_mps = sqrt(static_cast<double>(__uint_as_float(state->fastest_after_bits)));
}

template <Boundary kBoundary>
__global__ void locate_kernel(const __grid_constant__ ExactLaunch launch) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  ExactState& state = *launch.state;
  if (i == 0) state.progress.max_displacement = 0;
  if (i >= launch.space.num_parcels) return;
  ExactConstants c{launch.run, {scaled(launch.run.reference_ticks, state.progress.tick_exponent)}};
  c.plan.start = static_cast<std::uint32_t>(state.progress.now >> state.progress.tick_exponent);
  launch.arrays.present[state.current_buffer][i] = position_at<kBoundary>(c, trajectory_of(launch.arrays, i), 0);
}

__global__ void key_kernel(const __grid_constant__ ExactLaunch launch, const SortKeys keys) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= launch.space.num_parcels) return;
  keys.key[i] = cell_key(launch.space.grid, launch.arrays.present[launch.state->current_buffer][i]);
  keys.index[i] = i;
}

__global__ void copy_positions_kernel(const __grid_constant__ ExactLaunch launch, Vec2i* out) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i < launch.space.num_parcels) out[i] = launch.arrays.present[launch.state->current_buffer][i];
}

std::uint32_t max_slices() {
  int blocks = 0;
  int least = kSolveBlocksPerSm;
  for (const auto kernel :
       {solve_kernel<Boundary::open>, solve_kernel<Boundary::walls>, solve_kernel<Boundary::periodic>}) {
    PF_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kBlock, 0));
    least = std::min(least, blocks);
  }
  return usable_multiprocessors() * static_cast<std::uint32_t>(least);
}

}  // namespace

std::uint32_t exact_num_slices(std::uint32_t num_parcels) {
  const std::uint32_t wanted = (num_parcels + kParcelsPerSlice - 1) / kParcelsPerSlice;
  return std::clamp(wanted, 1U, std::max(1U, max_slices()));
}

void launch_exact_enter(const ExactLaunch& launch, std::uint64_t now, cudaStream_t stream) {
  enter_state_kernel<<<1, 1, 0, stream>>>(launch.state, now);
  const unsigned blocks = std::max(1U, blocks_for(launch.space.num_parcels));
  enter_kernel<<<blocks, kBlock, 0, stream>>>(launch, now);
  enter_done_kernel<<<1, 1, 0, stream>>>(launch.state);
  PF_LAUNCHED("enter_kernel");
}

void launch_exact_begin_request(const ExactLaunch& launch, cudaStream_t stream) {
  begin_request_kernel<<<1, kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("begin_request_kernel");
}

void launch_exact_locate(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    locate_kernel<kBoundary><<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("find_present_kernel");
}

void launch_exact_step(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    const unsigned blocks = std::max(1U, blocks_for(launch.space.num_parcels));
    predict_kernel<kBoundary><<<blocks, kBlock, 0, stream>>>(launch);
    PF_LAUNCHED("predict_kernel");
    const dim3 parts(launch.arrays.num_slices,
                     std::min(blocks_for(launch.arrays.active.capacity), kMaxPartsOfSlice));
    pair_kernel<kBoundary><<<parts, kBlock, 0, stream>>>(launch);
    PF_LAUNCHED("pair_kernel");
    ExactLaunch argument = launch;
    void* arguments[] = {&argument};
    PF_CUDA(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(solve_kernel<kBoundary>),
                                        dim3(launch.arrays.num_slices), dim3(kBlock), arguments, 0,
                                        stream));
    commit_kernel<kBoundary><<<parts, kBlock, 0, stream>>>(launch);
    PF_LAUNCHED("commit_kernel");
  });
}

void launch_exact_write_keys(const ExactLaunch& launch, const SortKeys& keys, cudaStream_t stream) {
  key_kernel<<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch, keys);
  PF_LAUNCHED("key_kernel");
}

void launch_exact_copy_positions(const ExactLaunch& launch, Vec2i* out, cudaStream_t stream) {
  if (launch.space.num_parcels == 0) return;
  copy_positions_kernel<<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch, out);
  PF_LAUNCHED("copy_present_kernel");
}

}  // namespace pf
