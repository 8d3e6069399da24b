#include "cuda/domains/domain_gpus.hpp"

#include <fmt/format.h>

#include <set>

#include "cuda/cuda_devices.hpp"
#include "cuda/domains/cuda_domain.cuh"
#include "cuda/domains/links.cuh"
#include "cuda/timer.cuh"

namespace pf {
namespace {

class CudaDomainGpus final : public DomainGpus {
 public:
  CudaDomainGpus() : num_(num_cuda_devices()) {
    if (num_ == 0) throw DeviceError("no CUDA device");
  }

  std::string name() const override {
    cudaDeviceProp properties{};
    PF_CUDA(cudaGetDeviceProperties(&properties, used_.empty() ? 0 : *used_.begin()));
    return used_.size() > 1 ? fmt::format("{} {}", used_.size(), properties.name) : properties.name;
  }

  void check_room(std::size_t num_parcels, const Placement& all, std::uint64_t held_bytes) const override {
    for (const int device : used_) {
      const DeviceScope scope(device);
      const unsigned here = num_on(device, all.num_here);
      const double share = static_cast<double>(here) / all.num_domains;
      const double needed = CudaDomain::kBytesPerParcel * share * static_cast<double>(num_parcels);
      const double available = kUsableShare * (static_cast<double>(usable_memory_bytes()) +
                                               static_cast<double>(here * held_bytes));
      if (needed <= available) continue;
      throw UserError(
          fmt::format("air.num_parcels: {} of the {} domains share a GPU, and their parcels need {:.2f} GB "
                      "of its memory, {:.2f} GB are free; at most about {:.0f} parcels fit",
                      here, all.num_domains, needed * 1e-9, available * 1e-9,
                      static_cast<double>(num_parcels) * available / needed));
    }
  }

  // A device is looked at when it is needed: other processes may have the others to themselves.
  std::unique_ptr<Domain> make(unsigned index, unsigned place) override {
    const int device = static_cast<int>(place % static_cast<unsigned>(num_));
    const DeviceScope scope(device);
    if (used_.count(device) == 0) {
      const std::string obstacle = cuda_device_obstacle(device);
      if (!obstacle.empty()) throw DeviceError(obstacle);
      used_.insert(device);
    }
    return std::make_unique<CudaDomain>(index, device);
  }

  std::unique_ptr<MotionLink> link(const std::vector<std::unique_ptr<Domain>>& domains, Carrier& carrier,
                                   std::string& why) override {
    std::vector<CudaDomain*> here;
    for (const auto& domain : domains) here.push_back(static_cast<CudaDomain*>(domain.get()));
    return carrier.num_ranks() == 1 ? link_peers(std::move(here), why) : link_ranks(here, carrier, why);
  }

  double measure_copy_bandwidth(std::size_t num_bytes) override {
    double total = 0.0;
    for (const int device : used_) {
      const DeviceScope scope(device);
      total += measure_device_copy(num_bytes, nullptr);
    }
    return total;
  }

 private:
  // Domains of this machine that are on the device.
  unsigned num_on(int device, unsigned num_here) const {
    const auto first = static_cast<unsigned>(device), num = static_cast<unsigned>(num_);
    return num_here > first ? (num_here - first - 1) / num + 1 : 0;
  }

  int num_;
  std::set<int> used_;
};

}  // namespace

std::unique_ptr<DomainGpus> make_domain_gpus() { return std::make_unique<CudaDomainGpus>(); }

}  // namespace pf
