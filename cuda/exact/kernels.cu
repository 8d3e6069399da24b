#include "cuda/exact/kernels.cuh"

#include <algorithm>

#include "cuda/blocks.cuh"
#include "cuda/check.cuh"
#include "cuda/cuda_devices.hpp"
#include "cuda/exact/ball_retrace.cuh"
#include "cuda/exact/predict.cuh"
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
constexpr std::uint32_t kManyParcels = 4'000'000;
constexpr unsigned kMaxPartsOfSlice = 8;
// ms at 10^5, 10^6, 10^7: 0.012 0.031 0.20; with 1 0.015 0.038 0.21; with 4 0.022 0.063 0.30.
constexpr unsigned kLanesOfPair = 2;

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
    if (is_over(launch) && state.paused == 0 && state.unresolvable == 0 && blockIdx.x == 0 &&
        blockIdx.y == 0 && threadIdx.x == 0 && launch.next_until > state.progress.now)
      plan_next(launch, launch.next_until, launch.next_chord_ends);
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
    plan_next(launch, launch.next_until, launch.next_chord_ends);
}

__global__ void __launch_bounds__(kBlock) draw_paused_kernel(const __grid_constant__ ExactLaunch launch) {
  if (launch.state->paused != 0) draw_current(launch, blockIdx.x * kBlock + threadIdx.x);
}

std::uint32_t max_slices(bool are_few) {
  int blocks = 0;
  int min_blocks = are_few ? kFewBlocks : kMoreBlocks;
  for (const SolveKernel kernel :
       {solve_kernel_of<Boundary::open>(are_few), solve_kernel_of<Boundary::walls>(are_few),
        solve_kernel_of<Boundary::periodic>(are_few)}) {
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
  return std::clamp(wanted, 1U, std::max(1U, max_slices(are_few)));
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
    const SolveKernel kernel = solve_kernel_of<kBoundary>(are_few);
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
