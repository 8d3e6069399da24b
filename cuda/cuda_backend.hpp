// The CUDA backend: state on the device from start to end. Only the ball, the tallies and, where GL memory
// cannot be mapped, the drawn positions cross to the host.
#pragma once

#include <memory>
#include <string>

#include "backend/backend.hpp"

namespace pf {

// Devices that CUDA sees; 0 without a driver or a device. why: what CUDA said, when there is none.
int num_cuda_devices(std::string* why = nullptr);

// Throws DeviceError if the device cannot be used.
std::unique_ptr<Backend> make_cuda_backend(int device);

}  // namespace pf
