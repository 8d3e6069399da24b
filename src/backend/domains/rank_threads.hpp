// Threads of a rank.
#pragma once

#include <sched.h>

#include <algorithm>
#include <thread>

#include "backend/domains/carrier.hpp"

namespace pf {

// wanted: 0 means the CPUs on which the launcher lets this process run, shared with the ranks that run on the
// same ones.
inline unsigned threads_of_rank(const Carrier& carrier, unsigned wanted) {
  if (wanted > 0) return wanted;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  const bool is_known = sched_getaffinity(0, sizeof(cpus), &cpus) == 0;
  const unsigned num =
      is_known ? static_cast<unsigned>(CPU_COUNT(&cpus)) : std::thread::hardware_concurrency();
  return std::max(1U, num / carrier.num_ranks_on_cpus());
}

}  // namespace pf
