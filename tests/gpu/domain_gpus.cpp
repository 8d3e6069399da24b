// The tests of domains on GPUs.
#include "cuda/domains/domain_gpus.hpp"

#include "cuda/cuda_devices.hpp"
#include "domains/thread_ranks.hpp"

namespace pf::test {

bool are_domains_on_gpus() { return true; }
std::shared_ptr<DomainGpus> domain_gpus() { return num_cuda_devices() > 0 ? make_domain_gpus() : nullptr; }

}  // namespace pf::test
