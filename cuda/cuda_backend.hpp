// The CUDA backend: state on the device from start to end. Only the ball, the tallies and, where GL memory
// cannot be mapped, the drawn positions cross to the host.
#pragma once

#include <memory>

#include "backend/backend.hpp"

namespace pf {

// Throws DeviceError if the device cannot be used (cuda_devices.hpp says why).
std::unique_ptr<Backend> make_cuda_backend(int device);

}  // namespace pf
