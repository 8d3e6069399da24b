// Load of the machine by other processes while a study runs. The load average would count the study itself.
#pragma once

#include <chrono>

namespace pf {

class MachineLoad {
 public:
  MachineLoad();  // starts to measure

  // Mean number of cores busy since the start with anything but this process and its ended children. Includes
  // time that a hypervisor gave to other guests. 0 if the system does not tell.
  double cores_used_by_others() const;

 private:
  double busy_s_ = 0.0;  // of all cores, since boot
  double own_s_ = 0.0;
  std::chrono::steady_clock::time_point start_;
};

// From this share of all cores on, measured times are upper bounds.
constexpr double kMaxUnloadedShare = 0.1;

}  // namespace pf
