// Kernels that follow one another in a stream without a gap: the blocks of the next one are brought onto the
// multiprocessors while those of the last one still work (programmatic dependent launch, CUDA C++
// Programming Guide). Devices before Hopper (9.0) leave the usual gap.
#pragma once

#include <type_traits>

#include "cuda/check.cuh"
#include "cuda/cuda_devices.hpp"

namespace pf {

// The first statement of a kernel that launch_in_turn() launches. All that earlier kernels wrote can be read
// after it. The next kernel may start once all blocks of this one have come here.
__device__ inline void begin_in_turn() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  cudaTriggerProgrammaticLaunchCompletion();
  cudaGridDependencySynchronize();
#endif
}

// The same, but the next kernel starts only when the one before this one has ended. Before its
// begin_in_turn() it may read what this one does not write.
__device__ inline void begin_when_complete() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

template <class... Parameters>
void launch_in_turn(void (*kernel)(Parameters...), unsigned num_blocks, unsigned block, cudaStream_t stream,
                    const std::type_identity_t<Parameters>&... arguments) {
  cudaLaunchAttribute attribute{};
  attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  attribute.val.programmaticStreamSerializationAllowed = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(num_blocks);
  config.blockDim = dim3(block);
  config.stream = stream;
  config.attrs = &attribute;
  config.numAttrs = has_launches_in_turn() ? 1 : 0;
  PF_CUDA(cudaLaunchKernelEx(&config, kernel, arguments...));
}

}  // namespace pf
