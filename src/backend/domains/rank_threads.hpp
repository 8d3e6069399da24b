// Threads of a rank.
#pragma once

#include <algorithm>
#include <thread>

#include "backend/domains/carrier.hpp"

namespace pf {

// wanted: 0 means all of the machine, shared by its ranks.
inline unsigned threads_of_rank(const Carrier& carrier, unsigned wanted) {
  if (wanted > 0) return wanted;
  return std::max(1U, std::thread::hardware_concurrency() / carrier.num_ranks_here());
}

}  // namespace pf
