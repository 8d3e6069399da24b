// The tests of domains on processors.
#include "domains/thread_ranks.hpp"

namespace pf::test {

bool are_domains_on_gpus() { return false; }
std::shared_ptr<DomainGpus> domain_gpus() { return nullptr; }

}  // namespace pf::test
