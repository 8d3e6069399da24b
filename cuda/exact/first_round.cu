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

#ifndef PF_FR
#define PF_FR 4
#endif
constexpr unsigned kBlocksPerSm = blocks_per_sm(PF_FR, kExactBlock);

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

}  // namespace

void launch_first_round(const ExactLaunch& launch, cudaStream_t stream) {
  const unsigned num_slices = launch.memory.num_slices;
  const unsigned num_blocks = kBlocksPerSm * usable_multiprocessors();
  const dim3 grid(num_slices, (num_blocks + num_slices - 1) / num_slices);
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    first_round_kernel<kBoundary><<<grid, kExactBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("first_round_kernel");
}

}  // namespace pf::cuda
