// Links between domains on GPUs: copies within a process, NCCL between processes.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "backend/domains/carrier.hpp"
#include "cuda/domains/cuda_domain.cuh"

namespace pf {

// Names a GPU among those of all machines.
using GpuName = std::array<char, 16>;
// Throws nothing: a GPU whose name cannot be had is called as all of those.
GpuName name_of_gpu(int device);

// Between all domains of the world, which are those of this process.
std::unique_ptr<MotionLink> link_peers(std::vector<CudaDomain*> domains, std::string& why);

// Between the domains of this rank and those of others, by NCCL; null with the reason if a rank cannot. All
// ranks call it, and get the same.
std::unique_ptr<MotionLink> link_ranks(const std::vector<CudaDomain*>& domains, Carrier& carrier,
                                       std::string& why);

// 10000 * major + 100 * minor + patch; 0: the program was built without NCCL.
int nccl_version();
std::string nccl_version_text(int version);

// Each rank has one domain, and a version of NCCL that can connect them. As link_ranks.
std::unique_ptr<MotionLink> link_by_nccl(CudaDomain& domain, Carrier& carrier, std::string& why);

}  // namespace pf
