// Motion goes by copies from GPU to GPU, or within one.
//
// A step has ended on all domains before the next begins, so that what a domain sends is complete. What still
// needs an order is within a step: ghosts are unpacked after the transfer to them, and what is sent is
// written anew only after all transfers from it.
#include <fmt/format.h>

#include <numeric>
#include <set>

#include "cuda/domains/links.cuh"

namespace pf {
namespace {

// Lets `device` read and write the memory of `other`. False: the driver takes its copies through the host, as
// where a device has as many such partners as it can have.
bool enable_access(int device, int other) {
  int can_access = 0;
  PF_CUDA(cudaDeviceCanAccessPeer(&can_access, device, other));
  if (can_access == 0) return false;
  const DeviceScope scope(device);
  const cudaError_t result = cudaDeviceEnablePeerAccess(other, 0);
  cudaGetLastError();  // clears it
  return result == cudaSuccess || result == cudaErrorPeerAccessAlreadyEnabled;
}

// Returns whether a copy from one device to another arrives. It does not on some machines whose IOMMU
// translates the traffic between GPUs, although these report access to each other's memory.
bool does_arrive(int from, int to) {
  std::vector<std::uint32_t> sent(1024), received(sent.size());
  std::iota(sent.begin(), sent.end(), 0x9E3779B9U + static_cast<std::uint32_t>(from));
  const std::size_t num_bytes = sent.size() * sizeof(std::uint32_t);
  DeviceBuffer<std::uint32_t> source, target;
  {
    const DeviceScope scope(from);
    source = DeviceBuffer<std::uint32_t>(sent.size());
    PF_CUDA(cudaMemcpy(source.data(), sent.data(), num_bytes, cudaMemcpyHostToDevice));
  }
  const DeviceScope scope(to);
  target = DeviceBuffer<std::uint32_t>(sent.size());
  PF_CUDA(cudaMemcpyPeer(target.data(), to, source.data(), from, num_bytes));
  PF_CUDA(cudaMemcpy(received.data(), target.data(), num_bytes, cudaMemcpyDeviceToHost));
  return received == sent;
}

// Names a pair of devices between which copies do not arrive; empty if there is none.
std::string unconnected_pair(const std::set<int>& devices) {
  for (const int from : devices) {
    for (const int to : devices) {
      if (!does_arrive(from, to)) return fmt::format("GPU {} to GPU {}", from, to);
    }
  }
  return "";
}

class PeerLink final : public MotionLink {
 public:
  PeerLink(std::vector<CudaDomain*> domains, std::string name)
      : domains_(std::move(domains)), name_(std::move(name)) {
    for (CudaDomain* domain : domains_) domain->link();
  }

  std::string name() const override { return name_; }

  void update_ghosts() override {
    for (unsigned to = 0; to < domains_.size(); ++to) {
      for (unsigned from = 0; from < domains_.size(); ++from) copy(from, to);
      domains_[to]->note_transfers();
    }
    for (unsigned to = 0; to < domains_.size(); ++to) {
      for (unsigned from = 0; from < domains_.size(); ++from) {
        if (!domains_[from]->sent_to(to).empty()) domains_[from]->wait_for_transfers_to(*domains_[to]);
      }
    }
  }

 private:
  void copy(unsigned from, unsigned to) {
    const CudaDomain::Motion sent = domains_[from]->sent_to(to);
    if (sent.empty()) return;
    const DeviceScope scope(domains_[to]->device());
    PF_CUDA(cudaMemcpyPeerAsync(domains_[to]->ghosts_of(from).data(), domains_[to]->device(), sent.data(),
                                domains_[from]->device(), sent.size_bytes(), domains_[to]->link_stream()));
  }

  std::vector<CudaDomain*> domains_;  // by slab
  std::string name_;
};

}  // namespace

std::unique_ptr<MotionLink> link_peers(std::vector<CudaDomain*> domains, std::string& why) {
  std::set<int> devices;
  for (const CudaDomain* domain : domains) devices.insert(domain->device());
  bool is_direct = true;
  for (const int device : devices) {
    for (const int other : devices) {
      if (device != other) is_direct = enable_access(device, other) && is_direct;
    }
  }
  if (const std::string pair = unconnected_pair(devices); !pair.empty()) {
    why = fmt::format("copies from {} do not arrive", pair);
    return nullptr;
  }
  std::string name = "copies within one GPU";
  if (devices.size() > 1)
    name = fmt::format("copies between {} GPUs{}", devices.size(),
                       is_direct ? "" : ", some through the host, since they do not see each other's memory");
  return std::make_unique<PeerLink>(std::move(domains), std::move(name));
}

}  // namespace pf
