// Threads of a rank.
#pragma once

#include <sched.h>

#include <algorithm>
#include <thread>

#include "backend/domains/carrier.hpp"

namespace pf {

// wanted: 0 means all cores that the launcher has bound this process to, or the machine's, shared by its
// ranks.
inline unsigned threads_of_rank(const Carrier& carrier, unsigned wanted) {
  if (wanted > 0) return wanted;
  const unsigned all = std::max(1U, std::thread::hardware_concurrency());
  cpu_set_t bound;
  CPU_ZERO(&bound);
  const bool is_known = sched_getaffinity(0, sizeof(bound), &bound) == 0;
  const unsigned own = is_known ? static_cast<unsigned>(CPU_COUNT(&bound)) : all;
  return own < all ? std::max(1U, own) : std::max(1U, all / carrier.num_ranks_here());
}

}  // namespace pf
