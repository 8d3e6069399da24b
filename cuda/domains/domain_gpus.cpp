#include "cuda/domains/domain_gpus.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

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
    PF_CUDA(cudaGetDeviceProperties(&properties, num_on_.empty() ? 0 : num_on_.begin()->first));
    return num_on_.size() > 1 ? fmt::format("{} {}", num_on_.size(), properties.name) : properties.name;
  }

  void find_sharing(Carrier& carrier) override {
    std::vector<GpuName> mine;  // of each domain: as many as any rank has
    for (const int device : devices_) mine.push_back(name_of_gpu(device));
    std::vector<GpuName> all(mine.size() * carrier.num_ranks());
    carrier.all_gather(mine.data(), sizeof(GpuName) * mine.size(), all.data());
    for (std::size_t k = 0; k < mine.size(); ++k)
      num_on_[devices_[k]] = static_cast<unsigned>(std::ranges::count(all, mine[k]));
  }

  void check_room(std::size_t num_parcels, unsigned num_domains, std::uint64_t held_bytes) const override {
    for (const auto& [device, here] : num_on_) {
      const DeviceScope scope(device);
      const double share = static_cast<double>(here) / num_domains;
      const double needed = CudaDomain::kBytesPerParcel * share * static_cast<double>(num_parcels);
      const double available = kUsableShare * (static_cast<double>(usable_memory_bytes()) +
                                               static_cast<double>(here * held_bytes));
      if (needed <= available) continue;
      throw UserError(
          fmt::format("air.num_parcels: {} of the {} domains share a GPU, and their parcels need {:.2f} GB "
                      "of its memory, {:.2f} GB are free; at most about {:.0f} parcels fit",
                      here, num_domains, needed * 1e-9, available * 1e-9,
                      static_cast<double>(num_parcels) * available / needed));
    }
  }

  // A device is looked at when it is needed: other processes may have the others to themselves.
  std::unique_ptr<Domain> make(unsigned index, unsigned place) override {
    const int device = static_cast<int>(place % static_cast<unsigned>(num_));
    const DeviceScope scope(device);
    if (num_on_.count(device) == 0) {
      const std::string obstacle = cuda_device_obstacle(device);
      if (!obstacle.empty()) throw DeviceError(obstacle);
    }
    devices_.push_back(device);
    ++num_on_[device];
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
    for (const auto& [device, num] : num_on_) {
      const DeviceScope scope(device);
      total += measure_device_copy(num_bytes, nullptr);
    }
    return total;
  }

 private:
  int num_;
  std::vector<int> devices_;        // of each domain of this rank, in order
  std::map<int, unsigned> num_on_;  // domains that are known to be on each of them
};

}  // namespace

std::unique_ptr<DomainGpus> make_domain_gpus() { return std::make_unique<CudaDomainGpus>(); }

}  // namespace pf
