// CUDA and GL together: draw targets for the CUDA backend, and the choice of its device.
#pragma once

#include <memory>
#include <string>

#include "view/parcel_buffers.hpp"

namespace pf {

// The CUDA device that drives the current GL context. If there is none, egl_cuda_device (EGL_CUDA_DEVICE_NV);
// if that is negative, 0. There must be a CUDA device.
int cuda_device_of_gl(int egl_cuda_device);

// kind: "interop" (CUDA writes mapped GL buffers), "staged" (device -> page-locked memory -> GL), "host"
// (directly into persistently mapped GL memory), or "auto": the first of these that works, with the reason.
// Throws DeviceError if the requested kind does not work. The GL context must be current.
std::unique_ptr<GlDrawTarget> make_cuda_draw_target(const std::string& kind);

}  // namespace pf
