// The GPUs of this machine, for the domains of this process.
#pragma once

#include <memory>

#include "backend/domains/domain.hpp"

namespace pf {

// Throws DeviceError with the reason if there is no device that can be used.
std::unique_ptr<DomainGpus> make_domain_gpus();

}  // namespace pf
