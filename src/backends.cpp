#include "backends.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "backend/domains/domain_backend.hpp"
#include "core/error.hpp"
#include "process.hpp"
#if PF_HAVE_CUDA
#include "cuda/cuda_backend.hpp"
#include "cuda/cuda_devices.hpp"
#include "cuda/domains/domain_gpus.hpp"
#endif

namespace pf {
namespace {

#if PF_HAVE_CUDA
std::shared_ptr<DomainGpus> domain_gpus() { return make_domain_gpus(); }
#else
std::shared_ptr<DomainGpus> domain_gpus() { throw DeviceError("this build has no CUDA backend"); }
#endif

LinkChoice link_choice(const Options& options) {
  if (options.domain_link == "host") return LinkChoice::host;
  return options.domain_link == "direct" ? LinkChoice::direct : LinkChoice::automatic;
}

unsigned num_domains(const Options& options, const Ranks& ranks) {
  return options.domains > 0 ? static_cast<unsigned>(options.domains) : ranks.num();
}

// Domains of this process and others.
std::unique_ptr<Backend> domain_backend(const Options& options, const Ranks& ranks,
                                        std::shared_ptr<DomainGpus> gpus) {
  const unsigned num = num_domains(options, ranks);
  if (num > kMaxDomains)
    throw UserError(fmt::format("mpirun: {} processes; give at most {}", num, kMaxDomains));
  if (num % ranks.num() != 0) {
    throw UserError(fmt::format("--domains: {} is not a multiple of the {} processes of mpirun; give {}", num,
                                ranks.num(), ranks.num() * std::max(1U, num / ranks.num())));
  }
  return make_domain_backend(ranks.carrier(), num, static_cast<unsigned>(options.settings.threads),
                             std::move(gpus), link_choice(options));
}

// On GPUs, or null, and the reason.
std::unique_ptr<Backend> try_gpus(const Options& options, int cuda_device, const Ranks& ranks,
                                  std::string& obstacle) {
  obstacle = cuda_obstacle();
  if (!obstacle.empty()) return nullptr;
  try {
    if (ranks.num() == 1 && options.domains <= 1) return cuda_backend_on(cuda_device);
    return domain_backend(options, ranks, domain_gpus());
  } catch (const DeviceError& error) {
    obstacle = error.what();
    return nullptr;
  }
}

}  // namespace

std::string cuda_obstacle() {
#if PF_HAVE_CUDA
  std::string why;
  return num_cuda_devices(&why) > 0 ? "" : "no CUDA device (" + (why.empty() ? "none found" : why) + ")";
#else
  return "this build has no CUDA backend";
#endif
}

#if PF_HAVE_CUDA
int num_gpus() { return std::max(1, num_cuda_devices()); }
std::unique_ptr<Backend> cuda_backend_on(int device) { return make_cuda_backend(device); }
#else
int num_gpus() { return 1; }
std::unique_ptr<Backend> cuda_backend_on(int) { throw DeviceError("this build has no CUDA backend"); }
#endif

std::unique_ptr<Backend> choose_backend(const Options& options, int cuda_device, const Ranks& ranks) {
  const bool are_gpus_linked = options.cuda && (ranks.num() > 1 || options.domains > 1);
  if (options.domain_link == "direct" && !are_gpus_linked)
    throw UserError("--domain-link: direct needs domains on GPUs; add --cuda, and --domains or mpirun");
  if (options.cuda) {
    std::string obstacle;
    if (auto backend = try_gpus(options, cuda_device, ranks, obstacle)) return backend;
    if (options.cuda_no_fallback)
      throw DeviceError("--cuda-no-fallback: " + obstacle + "; leave it out to fall back to the CPU");
    if (options.domain_link == "direct")
      throw DeviceError("--domain-link direct: " + obstacle + "; give auto to fall back to the CPU");
    announce(fmt::format("--cuda: {}; falling back to the CPU", obstacle));
  }
  if (ranks.num() > 1 || options.domains > 1) return domain_backend(options, ranks, nullptr);
  return make_cpu_backend(static_cast<unsigned>(options.settings.threads));
}

MethodSet refused_methods(const Options& options, const Ranks& ranks) {
  MethodSet refused{};
  if (num_domains(options, ranks) == 1) return refused;
  for (const MethodRow& row : kMethods)
    refused[static_cast<std::size_t>(row.method)] = !refusal_in_domains(row.method).empty();
  return refused;
}

std::shared_ptr<DomainGpus> find_domain_gpus() { return cuda_obstacle().empty() ? domain_gpus() : nullptr; }

}  // namespace pf
