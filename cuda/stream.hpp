// The stream of all CUDA work of the program, including GL's mapping: the device works in the order of the
// calls.
#pragma once

#include <cuda_runtime.h>

namespace pf {

// Created at the first call, on the device that is current then; lives as long as the program.
cudaStream_t work_stream();

}  // namespace pf
