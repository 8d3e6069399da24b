// The current device of this thread, for a while.
#pragma once

#include "cuda/check.cuh"

namespace pf {

// Makes a device the current one until the end of the scope, and then restores the previous one.
class DeviceScope {
 public:
  explicit DeviceScope(int device) {
    PF_CUDA(cudaGetDevice(&before_));
    PF_CUDA(cudaSetDevice(device));
  }
  ~DeviceScope() { cudaSetDevice(before_); }
  DeviceScope(const DeviceScope&) = delete;
  DeviceScope& operator=(const DeviceScope&) = delete;

 private:
  int before_ = 0;
};

}  // namespace pf
