// solve_kernel for an open world.
#include "cuda/exact/solve_kernel.cuh"

namespace pf::cuda {

template SolveKernel solve_kernel_of<Boundary::open>(bool are_few);

}  // namespace pf::cuda
