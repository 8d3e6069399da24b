// How busy a machine was with other work while a study ran. The load average would count the study itself.
#pragma once

#include <chrono>

namespace pf {

class MachineLoad {
 public:
  MachineLoad();  // the watch begins

  // Share of all cores, 0 to 1, that something other than this process and its ended children used since the
  // watch began, time that a hypervisor gave to its other guests included; 0 if the system does not say.
  double share_of_others() const;

 private:
  double busy_s_ = 0.0;  // of all cores since the machine started
  double own_s_ = 0.0;
  std::chrono::steady_clock::time_point start_;
};

// Share from which on times are upper bounds.
constexpr double kLoadThatCounts = 0.1;

}  // namespace pf
