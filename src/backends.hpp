// Chooses what computes: processors or GPUs, in one domain or several.
#pragma once

#include <memory>
#include <string>

#include "app/options.hpp"
#include "backend/backend.hpp"
#include "ranks.hpp"

namespace pf {

// Reason why there is no CUDA device, or "".
std::string cuda_obstacle();
// Number of GPUs, or 1 if there is none.
int num_gpus();
// Throws DeviceError if the device cannot be used, or the program has no CUDA backend.
std::unique_ptr<Backend> cuda_backend_on(int device);

// Makes the backend that the options ask for. cuda_device: for a backend of one domain. Announces a fallback
// to processors on stderr. Throws UserError and DeviceError.
std::unique_ptr<Backend> choose_backend(const Options& options, int cuda_device, const Ranks& ranks);

// Methods that it will not be able to fly.
MethodSet refused_methods(const Options& options, const Ranks& ranks);

// The GPUs of this process, for the domains of ranks that serve; null without any.
std::shared_ptr<DomainGpus> find_domain_gpus();

}  // namespace pf
