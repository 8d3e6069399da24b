// In place of cuda/launch.cuh: a CPU leaves no gap between kernels.
#pragma once

#include <cuda_runtime.h>

#include "cuda/check.cuh"

namespace pf {

inline void begin_in_turn() {}
inline void begin_when_complete() {}

template <class... Parameters>
void launch_in_turn(void (*kernel)(Parameters...), unsigned num_blocks, unsigned block, cudaStream_t stream,
                    const std::type_identity_t<Parameters>&... arguments) {
  kernels_on_cpu::launch(num_blocks, block, 0, stream, kernel, arguments...);
}

}  // namespace pf
