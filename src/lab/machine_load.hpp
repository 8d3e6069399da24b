// How busy a machine was with other work while a study ran. The load average would count the study itself.
#pragma once

#include <chrono>

namespace pf {

class MachineLoad {
 public:
  MachineLoad();  // the watch begins

  // How many cores something other than this process and its ended children kept busy since the watch began,
  // on average, time that a hypervisor gave to its other guests included; 0 if the system does not say.
  double cores_used_by_others() const;

 private:
  double busy_s_ = 0.0;  // of all cores since the machine started
  double own_s_ = 0.0;
  std::chrono::steady_clock::time_point start_;
};

// Share of all cores from which on times are upper bounds.
constexpr double kLoadThatCounts = 0.1;

}  // namespace pf
