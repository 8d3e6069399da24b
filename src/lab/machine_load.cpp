#include "lab/machine_load.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace pf {
namespace {

// Reads the first line of /proc/stat: time of all cores in user, nice, system, idle, iowait, irq, softirq and
// steal, in clock ticks (proc(5)). Returns 0 if it cannot be read.
double busy_seconds() {
  std::ifstream in("/proc/stat");
  std::string name;
  double user = 0.0, nice = 0.0, system = 0.0, idle = 0.0, iowait = 0.0, irq = 0.0, softirq = 0.0,
         steal = 0.0;
  if (!(in >> name >> user >> nice >> system >> idle >> iowait >> irq >> softirq) || name != "cpu")
    return 0.0;
  if (!(in >> steal)) steal = 0.0;
  return (user + nice + system + irq + softirq + steal) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double own_seconds() {
  double sum = 0.0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    if (::getrusage(who, &usage) == 0) sum += seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }
  return sum;
}

}  // namespace

MachineLoad::MachineLoad()
    : busy_s_(busy_seconds()), own_s_(own_seconds()), start_(std::chrono::steady_clock::now()) {}

double MachineLoad::cores_used_by_others() const {
  const double passed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double others_s = (busy_seconds() - busy_s_) - (own_seconds() - own_s_);
  return passed_s > 0.0 ? std::max(0.0, others_s / passed_s) : 0.0;
}

}  // namespace pf
