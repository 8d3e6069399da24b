// Where CUDA meets GL: draw targets for the CUDA backend, and which device to run on.
#pragma once

#include <memory>
#include <string>

#include "view/parcel_buffers.hpp"

namespace pf {

// The CUDA device that drives the current GL context; else egl_cuda_device (EGL_CUDA_DEVICE_NV) if that is
// one; else 0. Needs at least one CUDA device.
int cuda_device_of_gl(int egl_cuda_device);

// kind: "interop" (CUDA writes mapped GL buffers), "staged" (device -> page-locked memory -> GL), "host"
// (straight into persistently mapped GL memory), or "auto": the first of these that works, with the reason.
// Throws DeviceError if the kind asked for cannot be had. The GL context must be current.
std::unique_ptr<GlDrawTarget> make_cuda_draw_target(const std::string& kind);

}  // namespace pf
