// The CUDA devices that the program can compute on, and how much of a device a backend may use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace pf {

// Devices that CUDA sees; 0 without a driver or a device. why: receives the reason if there is none.
int num_cuda_devices(std::string* why = nullptr);

// The reason why the program cannot compute on the device, with a remedy, in one line; empty if it can. The
// device becomes the current one.
std::string cuda_device_obstacle(int device);

// Limits of a backend's use of a device. There are none, unless the environment variable
// PICKLEFLIGHT_DEVICE_LIMITS sets some, as "multiprocessors=4 memory_mb=500"; tests use it for smaller GPUs.
struct DeviceLimits {
  std::uint32_t num_multiprocessors = UINT32_MAX;
  std::size_t memory_bytes = SIZE_MAX;  // of all allocations together
  // From so many on steps of the time-stepped methods are done in parts, and the first round of `exact` by a
  // kernel of its own; 0: where that is faster.
  std::uint32_t many_parcels = 0;
  // From so many on a thread looks around two parcels in steps in parts; 0: where that is faster.
  std::uint32_t many_for_two = 0;
  // From so many on the launches of a request without a ball are batched; 0: where that is faster.
  std::uint32_t many_steps = 0;
  std::uint32_t one_kernel = 0;     // of steps that are not in parts: 1 + OneKernel; 0: the fastest
  std::uint32_t solver_blocks = 0;  // of `exact` on a multiprocessor, 1 or 2; 0: by the number of parcels
};

// Throws UserError if the variable has another format.
DeviceLimits device_limits();

// Multiprocessors of the current device within the limits.
std::uint32_t usable_multiprocessors();

// Returns whether the code for the current device has begin_in_turn() (cuda/launch.cuh).
bool has_launches_in_turn();

// Free bytes of the current device's memory within the limits.
std::size_t usable_memory_bytes();
// Share of it that a backend asks for at most: allocations are rounded up.
constexpr double kUsableShare = 0.95;

}  // namespace pf
