// Checks of CUDA calls: a failure becomes a DeviceError with call, file and line.
#pragma once

#include <cuda_runtime.h>

#include <string>

#include "core/error.hpp"

namespace pf {

inline void check_cuda(cudaError_t result, const char* call, const char* file, int line) {
  if (result == cudaSuccess) return;
  cudaGetLastError();  // clears the error, so that the next check does not report it again
  throw DeviceError(std::string(call) + ": " + cudaGetErrorString(result) + " (" + cudaGetErrorName(result) +
                    ") at " + file + ":" + std::to_string(line));
}

}  // namespace pf

#define PF_CUDA(call) ::pf::check_cuda((call), #call, __FILE__, __LINE__)
#define PF_LAUNCHED(name) ::pf::check_cuda(cudaGetLastError(), "launch of " name, __FILE__, __LINE__)
