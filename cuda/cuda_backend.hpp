// The CUDA backend. Its state stays on the device. Only the ball, the tallies and, where GL memory cannot be
// mapped, the drawn positions cross to the host.
#pragma once

#include <memory>

#include "backend/backend.hpp"

namespace pf {

// Throws DeviceError with the reason if the device cannot be used.
std::unique_ptr<Backend> make_cuda_backend(int device);

}  // namespace pf
