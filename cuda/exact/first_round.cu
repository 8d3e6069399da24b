// Method `exact` on the device: the first round of solving, where there are many clusters. A kernel of its
// own has more warps on a multiprocessor than solve_kernel, whose registers are for clusters of a whole
// block.
#include "cuda/check.cuh"
#include "cuda/cuda_devices.hpp"
#include "cuda/exact/kernels.cuh"
#include "cuda/exact/solve.cuh"
#include "model/for_boundary.hpp"

namespace pf::cuda {
namespace {

// Gps of a gas on an H100 at 10^6, 10^7, 10^8, with the first round in solve_kernel, and here with 3 and with
// 4 blocks on a multiprocessor: 6.4, 9.8, 10.9; 7.1, 10.7, 11.8; 7.0, 11.0, 12.0.
constexpr unsigned kBlocksPerSm = blocks_per_sm(4, kExactBlock);
// With fewer parcels the longest clusters set the time, which more registers shorten: 10^5 1.99, here 1.90.
constexpr std::uint32_t kFewestParcels = 300'000;

// A block adds to the slice blockIdx.x.
template <Boundary kBoundary>
__global__ void __launch_bounds__(kExactBlock, kBlocksPerSm)
    first_round_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ WarpSpace space;
  if (is_over(launch)) return;
  const ExactConstants c = constants_of_window(launch);
  const StepContext step{launch, c};
  if (step.state.list_overflow != 0 || step.state.near_ball_overflow != 0) return;
  const ClustersToSolve clusters(step, gridDim.x, true);
  if (clusters.are_few) return;
  const BlockRank block{blockIdx.x + blockIdx.y * gridDim.x, gridDim.x * gridDim.y};
  if (block.rank == 0 && threadIdx.x == 0) step.state.first_round_is_done = 1;
  solve_by_warps<kBoundary>(step, block, clusters, space, step.memory.counts[blockIdx.x]);
}

bool has_first_round(std::uint32_t num_parcels) {
  const std::uint32_t many = device_limits().many_parcels;
  return num_parcels >= (many > 0 ? many : kFewestParcels);
}

}  // namespace

void launch_first_round(const ExactLaunch& launch, cudaStream_t stream) {
  if (!has_first_round(launch.space.num_parcels)) return;
  const unsigned num_slices = launch.memory.num_slices;
  const unsigned num_blocks = kBlocksPerSm * usable_multiprocessors();
  const dim3 grid(num_slices, (num_blocks + num_slices - 1) / num_slices);
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    first_round_kernel<kBoundary><<<grid, kExactBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("first_round_kernel");
}

}  // namespace pf::cuda
