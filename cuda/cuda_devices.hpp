// Which CUDA devices the program can compute on, and how much of one a backend may use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace pf {

// Devices that CUDA sees; 0 without a driver or a device. why: what CUDA said, when there is none.
int num_cuda_devices(std::string* why = nullptr);

// Why the program cannot compute on the device, in one line with a way out; empty if it can. The device
// becomes the current one.
std::string cuda_device_obstacle(int device);

// What of a device a backend uses: all of it, unless the environment variable PICKLEFLIGHT_DEVICE_LIMITS says
// less, as "multiprocessors=4 memory_mb=500". That is how tests stand in for a smaller GPU.
struct DeviceLimits {
  std::uint32_t num_multiprocessors = UINT32_MAX;
  std::size_t memory_bytes = SIZE_MAX;  // of all allocations together
};

// Throws UserError if the variable holds anything else.
DeviceLimits device_limits();

// Multiprocessors of the current device that may be used.
std::uint32_t usable_multiprocessors();

// Bytes of the current device's memory that are still free to be used.
std::size_t usable_memory_bytes();

}  // namespace pf
