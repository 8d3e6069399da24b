#include "cuda/domains/domain_gpus.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "cuda/cuda_devices.hpp"
#include "cuda/domains/cuda_domain.cuh"

namespace pf {
namespace {

constexpr double kUsable = 0.95;  // share of the free memory

// Bytes per second of a plain copy on the current device, read plus written.
double copy_bandwidth(std::size_t num_bytes) {
  constexpr int kRepeats = 10;
  const DeviceBuffer<std::byte> from(num_bytes), to(num_bytes);
  cudaEvent_t begin{}, end{};
  PF_CUDA(cudaEventCreate(&begin));
  PF_CUDA(cudaEventCreate(&end));
  const auto copy = [&] {
    PF_CUDA(cudaMemcpyAsync(to.data(), from.data(), num_bytes, cudaMemcpyDeviceToDevice, nullptr));
  };
  copy();
  PF_CUDA(cudaEventRecord(begin, nullptr));
  for (int repeat = 0; repeat < kRepeats; ++repeat) copy();
  PF_CUDA(cudaEventRecord(end, nullptr));
  PF_CUDA(cudaEventSynchronize(end));
  float ms = 0.0F;
  PF_CUDA(cudaEventElapsedTime(&ms, begin, end));
  PF_CUDA(cudaEventDestroy(begin));
  PF_CUDA(cudaEventDestroy(end));
  return 2e3 * static_cast<double>(num_bytes) * kRepeats / static_cast<double>(ms);
}

class CudaDomainGpus final : public DomainGpus {
 public:
  CudaDomainGpus() : num_(num_cuda_devices()) {
    if (num_ == 0) throw DeviceError("no CUDA device");
    for (int device = 0; device < num_; ++device) {
      const std::string obstacle = cuda_device_obstacle(device);
      if (!obstacle.empty()) throw DeviceError(obstacle);
    }
  }

  std::string name() const override {
    cudaDeviceProp properties{};
    PF_CUDA(cudaGetDeviceProperties(&properties, used_.empty() ? 0 : *used_.begin()));
    return properties.name;
  }
  void check_room(std::size_t num_parcels, std::uint64_t held_bytes) const override {
    const double num_used = static_cast<double>(std::max<std::size_t>(used_.size(), 1));
    double available = static_cast<double>(held_bytes);
    for (const int device : used_) {
      PF_CUDA(cudaSetDevice(device));
      available += static_cast<double>(usable_memory_bytes());
    }
    const double needed = CudaDomain::kBytesPerParcel * static_cast<double>(num_parcels);
    if (needed <= kUsable * available) return;
    throw UserError(
        fmt::format("air.num_parcels: {} parcels on {} GPUs of this machine need {:.2f} GB of their memory, "
                    "{:.2f} GB are "
                    "free; at most about {:.0f} fit",
                    num_parcels, num_used, needed * 1e-9, available * 1e-9,
                    static_cast<double>(num_parcels) * kUsable * available / needed));
  }
  std::unique_ptr<Domain> make(unsigned index, unsigned place) override {
    const int device = static_cast<int>(place % static_cast<unsigned>(num_));
    used_.insert(device);
    return std::make_unique<CudaDomain>(index, device);
  }
  double measure_copy_bandwidth(std::size_t num_bytes) override {
    double total = 0.0;
    for (const int device : used_) {
      PF_CUDA(cudaSetDevice(device));
      total += copy_bandwidth(num_bytes);
    }
    return total;
  }

 private:
  int num_;
  std::set<int> used_;
};

}  // namespace

std::unique_ptr<DomainGpus> make_domain_gpus() { return std::make_unique<CudaDomainGpus>(); }

}  // namespace pf
