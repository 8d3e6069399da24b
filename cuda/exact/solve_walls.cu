// solve_kernel for a world with walls.
#include "cuda/exact/solve_kernel.cuh"

namespace pf::cuda {

template SolveKernel solve_kernel_of<Boundary::walls>(bool are_few);

}  // namespace pf::cuda
