// Motion goes by copies from GPU to GPU, or within one.
//
// A step has ended on all domains before the next begins, so that what a domain sends is complete. What still
// needs an order is within a step: copies are unpacked after the transfer to them, and what is sent is
// written anew only after all transfers from it.
#include <fmt/format.h>

#include <set>

#include "cuda/domains/links.cuh"

namespace pf {
namespace {

// Lets `device` read and write the memory of `other`. False: the driver takes its copies through the host.
bool enable_access(int device, int other) {
  int can_access = 0;
  PF_CUDA(cudaDeviceCanAccessPeer(&can_access, device, other));
  if (can_access == 0) return false;
  const DeviceScope scope(device);
  const cudaError_t result = cudaDeviceEnablePeerAccess(other, 0);
  if (result == cudaErrorPeerAccessAlreadyEnabled) {
    cudaGetLastError();  // clears it
    return true;
  }
  PF_CUDA(result);
  return true;
}

class PeerLink final : public MotionLink {
 public:
  explicit PeerLink(std::vector<CudaDomain*> domains) : domains_(std::move(domains)) {
    std::set<int> devices;
    for (CudaDomain* domain : domains_) {
      domain->link();
      devices.insert(domain->device());
    }
    bool is_direct = true;
    for (const int device : devices) {
      for (const int other : devices) {
        if (device != other) is_direct = enable_access(device, other) && is_direct;
      }
    }
    if (devices.size() == 1) {
      name_ = "copies within one GPU";
    } else {
      name_ =
          fmt::format("copies between {} GPUs{}", devices.size(),
                      is_direct ? "" : ", some through the host, since they do not see each other's memory");
    }
  }

  std::string name() const override { return name_; }

  void update_copies() override {
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
    PF_CUDA(cudaMemcpyPeerAsync(domains_[to]->copies_of(from).data(), domains_[to]->device(), sent.data(),
                                domains_[from]->device(), sent.size_bytes(), domains_[to]->link_stream()));
  }

  std::vector<CudaDomain*> domains_;  // by slab
  std::string name_;
};

}  // namespace

std::unique_ptr<MotionLink> link_peers(std::vector<CudaDomain*> domains) {
  return std::make_unique<PeerLink>(std::move(domains));
}

}  // namespace pf
