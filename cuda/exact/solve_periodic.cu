// solve_kernel for a periodic world.
#include "cuda/exact/solve_kernel.cuh"

namespace pf::cuda {

template SolveKernel solve_kernel_of<Boundary::periodic>(bool are_few);

}  // namespace pf::cuda
