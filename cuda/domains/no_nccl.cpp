// In place of nccl_link.cpp, if the program is built without NCCL.
#include "cuda/domains/links.cuh"

namespace pf {

int nccl_version() { return 0; }

std::unique_ptr<MotionLink> link_by_nccl(CudaDomain&, Carrier&, std::string& why) {
  why = "NCCL is not used: the program is built without it";
  return nullptr;
}

}  // namespace pf
