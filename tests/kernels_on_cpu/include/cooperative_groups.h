// Groups of the threads of a grid, for a CPU.
#pragma once

#include <cuda_runtime.h>

namespace cooperative_groups {

class grid_group {
 public:
  void sync() const { kernels_on_cpu::wait_for_grid(); }
  unsigned long long size() const {
    return static_cast<unsigned long long>(gridDim.x) * gridDim.y * blockDim.x;
  }
  unsigned long long thread_rank() const {
    return (static_cast<unsigned long long>(blockIdx.y) * gridDim.x + blockIdx.x) * blockDim.x + threadIdx.x;
  }
};

inline grid_group this_grid() { return {}; }

}  // namespace cooperative_groups
