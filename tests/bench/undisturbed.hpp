// Ratios of speeds of two threads to one hold only where two processors are free.
#pragma once

#include <algorithm>
#include <string>
#include <thread>

#include "lab/machine_load.hpp"

namespace pf::test {

// Why a ratio below its limit says nothing; empty: it does. load: over the time of the measurement.
inline std::string disturbance(const MachineLoad& load) {
  const double others = load.cores_used_by_others();
  const double cores = std::max(1U, std::thread::hardware_concurrency());
  if (others <= kMaxUnloadedShare * cores) return "";
  return "other processes kept " + std::to_string(others) + " cores busy; repeat the test without them";
}

}  // namespace pf::test
