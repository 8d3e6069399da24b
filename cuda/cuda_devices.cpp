#include "cuda/cuda_devices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cstdlib>
#include <sstream>

#include "core/text.hpp"
#include "cuda/check.cuh"
#include "cuda/setup_kernels.cuh"

namespace pf {
namespace {

constexpr const char* kLimitsVariable = "PICKLEFLIGHT_DEVICE_LIMITS";

std::string dotted(const std::string& architecture) {
  const std::string number = architecture.substr(0, architecture.find('-'));
  return number.size() < 2 ? number : number.substr(0, number.size() - 1) + "." + number.back();
}

// PF_ARCHITECTURES in words: "75-real 80-real 90-virtual" becomes "7.5, 8.0 and PTX of 9.0".
std::string built_for() {
  std::istringstream in(PF_ARCHITECTURES);
  std::string text;
  for (std::string architecture; in >> architecture;) {
    const bool is_ptx = architecture.ends_with("-virtual");
    text += (text.empty() ? ""
             : is_ptx     ? " and "
                          : ", ") +
            std::string(is_ptx ? "PTX of " : "") + dotted(architecture);
  }
  return text;
}

std::size_t number_of(const std::string& limit, std::size_t start, std::size_t max = UINT32_MAX) {
  std::size_t value = 0;
  const char* end = limit.data() + limit.size();
  const auto [parsed, error] = std::from_chars(limit.data() + start, end, value);
  if (error == std::errc() && parsed == end && value > 0 && value <= max) return value;
  throw UserError(
      fmt::format("{}: {} takes a whole number from 1 to {}", kLimitsVariable, in_quotes(limit), max));
}

// A CUDA version, as 12040 for "12.4".
std::string version_text(int version) { return fmt::format("{}.{}", version / 1000, version % 1000 / 10); }

std::string driver_obstacle(cudaError_t result) {
  int driver = 0;
  cudaDriverGetVersion(&driver);
  if (driver == 0) return "no NVIDIA driver is installed";
  if (result != cudaErrorInsufficientDriver) return cudaGetErrorString(result);
  return fmt::format(
      "the NVIDIA driver is for CUDA {}, this program for CUDA {}; update the driver, or build with an older "
      "toolkit",
      version_text(driver), version_text(CUDART_VERSION));
}

}  // namespace

int num_cuda_devices(std::string* why) {
  int count = 0;
  const cudaError_t result = cudaGetDeviceCount(&count);
  if (result == cudaSuccess) return count;
  cudaGetLastError();
  if (why) *why = driver_obstacle(result);
  return 0;
}

std::string cuda_device_obstacle(int device) {
  cudaDeviceProp properties{};
  PF_CUDA(cudaSetDevice(device));
  PF_CUDA(cudaGetDeviceProperties(&properties, device));
  const cudaError_t result = find_kernel_image();
  if (result == cudaSuccess) return "";
  cudaGetLastError();
  const bool lacks_code =
      result == cudaErrorNoKernelImageForDevice || result == cudaErrorUnsupportedPtxVersion;
  if (!lacks_code) return fmt::format("{} cannot be used ({})", properties.name, cudaGetErrorString(result));
  return fmt::format(
      "{} has compute capability {}.{}, and this program has code for {}; build it on this machine, or with "
      "-DCMAKE_CUDA_ARCHITECTURES={}{} (7.5 and newer will do), or update the driver",
      properties.name, properties.major, properties.minor, built_for(), properties.major, properties.minor);
}

DeviceLimits device_limits() {
  DeviceLimits limits;
  const char* text = std::getenv(kLimitsVariable);
  std::istringstream in(text != nullptr ? text : "");
  for (std::string limit; in >> limit;) {
    constexpr std::string_view kMultiprocessors = "multiprocessors=", kMemory = "memory_mb=",
                               kSolver = "solver_blocks=", kMany = "many_parcels=", kForTwo = "many_for_two=",
                               kOneKernel = "one_kernel=", kManySteps = "many_steps=";
    if (limit.starts_with(kMultiprocessors)) {
      limits.num_multiprocessors = static_cast<std::uint32_t>(number_of(limit, kMultiprocessors.size()));
    } else if (limit.starts_with(kMemory)) {
      limits.memory_bytes = number_of(limit, kMemory.size()) * 1'000'000;
    } else if (limit.starts_with(kMany)) {
      limits.many_parcels = static_cast<std::uint32_t>(number_of(limit, kMany.size()));
    } else if (limit.starts_with(kForTwo)) {
      limits.many_for_two = static_cast<std::uint32_t>(number_of(limit, kForTwo.size()));
    } else if (limit.starts_with(kManySteps)) {
      limits.many_steps = static_cast<std::uint32_t>(number_of(limit, kManySteps.size()));
    } else if (limit.starts_with(kOneKernel)) {
      limits.one_kernel = static_cast<std::uint32_t>(number_of(limit, kOneKernel.size(), 3));
    } else if (limit.starts_with(kSolver)) {
      limits.solver_blocks = static_cast<std::uint32_t>(number_of(limit, kSolver.size(), 2));
    } else {
      throw UserError(
          fmt::format("{}: {} is not a limit; known: multiprocessors=N, memory_mb=N, many_parcels=N, "
                      "many_for_two=N, many_steps=N, one_kernel=N, solver_blocks=N",
                      kLimitsVariable, in_quotes(limit)));
    }
  }
  return limits;
}

std::uint32_t usable_multiprocessors() {
  int device = 0, num = 0;
  PF_CUDA(cudaGetDevice(&device));
  PF_CUDA(cudaDeviceGetAttribute(&num, cudaDevAttrMultiProcessorCount, device));
  return std::min(static_cast<std::uint32_t>(num), device_limits().num_multiprocessors);
}

// Asked once for each device, since it is needed at every launch.
bool has_launches_in_turn() {
  constexpr int kMaxDevices = 64, kHopper = 90;
  enum : signed char { unknown, no, yes };
  static std::array<std::atomic<signed char>, kMaxDevices> answers{};
  int device = 0;
  PF_CUDA(cudaGetDevice(&device));
  if (device >= kMaxDevices) return false;
  std::atomic<signed char>& answer = answers[static_cast<std::size_t>(device)];
  if (answer == unknown) answer = version_of_code() >= kHopper ? yes : no;
  return answer == yes;
}

std::size_t usable_memory_bytes() {
  std::size_t free_bytes = 0, total = 0;
  PF_CUDA(cudaMemGetInfo(&free_bytes, &total));
  const std::size_t limit = device_limits().memory_bytes, used = total - free_bytes;
  return std::min(free_bytes, limit > used ? limit - used : 0);
}

}  // namespace pf
