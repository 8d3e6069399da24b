// Decides if the ranks can use NCCL. All ranks see the same facts, so that they decide alike.
#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <optional>
#include <utility>

#include "cuda/domains/links.cuh"

namespace pf {
namespace {

// NCCL takes two ranks on one GPU from this version on, if the variable is 1.
constexpr int kSharingVersion = 23000;
constexpr const char* kSharingVariable = "NCCL_MULTI_RANK_GPU_ENABLE";

// Message of a rank to the others.
struct RankFacts {
  int version = 0;  // of NCCL
  unsigned num_domains = 0;
  bool may_share = false;  // a GPU with another rank
  GpuName gpu{};
};

RankFacts facts_of(const std::vector<CudaDomain*>& domains) {
  RankFacts facts;
  facts.version = nccl_version();
  facts.num_domains = static_cast<unsigned>(domains.size());
  const char* sharing = std::getenv(kSharingVariable);
  facts.may_share = sharing != nullptr && std::strcmp(sharing, "1") == 0 && facts.version >= kSharingVersion;
  facts.gpu = name_of_gpu(domains[0]->device());
  return facts;
}

// Two ranks on one GPU.
std::optional<std::pair<std::size_t, std::size_t>> sharing_ranks(const std::vector<RankFacts>& all) {
  for (std::size_t b = 0; b < all.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      if (all[a].gpu == all[b].gpu) return std::pair(a, b);
    }
  }
  return std::nullopt;
}

// Why the ranks cannot use NCCL, or "".
std::string obstacle(const std::vector<RankFacts>& all) {
  bool may_share = true;
  for (std::size_t rank = 0; rank < all.size(); ++rank) {
    if (all[rank].version == 0)
      return rank == 0 ? "the program is built without it"
                       : fmt::format("the program of process {} is built without it", rank);
    if (all[rank].version != all[0].version)
      return fmt::format("its version is {} in process {}, {} in process 0",
                         nccl_version_text(all[rank].version), rank, nccl_version_text(all[0].version));
    if (all[rank].num_domains != 1) return "it needs one domain for each process";
    may_share = may_share && all[rank].may_share;
  }
  const auto sharing = sharing_ranks(all);
  if (!sharing || may_share) return "";
  const std::string remedy = all[0].version >= kSharingVersion
                                 ? fmt::format("; {}=1 allows that", kSharingVariable)
                                 : ", which it takes from version 2.30 on";
  return fmt::format("processes {} and {} share a GPU{}", sharing->first, sharing->second, remedy);
}

}  // namespace

GpuName name_of_gpu(int device) {
  GpuName name{};
  cudaDeviceProp properties{};
  if (cudaGetDeviceProperties(&properties, device) == cudaSuccess)
    std::memcpy(name.data(), properties.uuid.bytes, name.size());
  cudaGetLastError();
  return name;
}

std::string nccl_version_text(int version) {
  return fmt::format("{}.{}.{}", version / 10000, version / 100 % 100, version % 100);
}

std::unique_ptr<MotionLink> link_ranks(const std::vector<CudaDomain*>& domains, Carrier& carrier,
                                       std::string& why) {
  const RankFacts mine = facts_of(domains);
  std::vector<RankFacts> all(carrier.num_ranks());
  carrier.all_gather(&mine, sizeof(mine), all.data());
  const std::string reason = obstacle(all);
  if (reason.empty()) return link_by_nccl(*domains[0], carrier, why);
  const std::string version = all[0].version > 0 ? " " + nccl_version_text(all[0].version) : "";
  why = fmt::format("NCCL{} is not used: {}", version, reason);
  return nullptr;
}

}  // namespace pf
