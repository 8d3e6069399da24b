// Other programs that use the processors.
#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <vector>

namespace pf::test {

// Processes that never rest, until the end of the scope.
class BusyProcesses {
 public:
  explicit BusyProcesses(unsigned num) {
    for (unsigned k = 0; k < num; ++k) {
      const pid_t process = ::fork();
      if (process == 0) {
        ::alarm(60);  // ends it if nobody else does
        for (std::atomic<unsigned> turns{0};; ++turns) {
        }
      }
      if (process > 0) processes_.push_back(process);
    }
  }
  ~BusyProcesses() {
    for (const pid_t process : processes_) {
      ::kill(process, SIGKILL);
      ::waitpid(process, nullptr, 0);
    }
  }
  BusyProcesses(const BusyProcesses&) = delete;
  BusyProcesses& operator=(const BusyProcesses&) = delete;

 private:
  std::vector<pid_t> processes_;
};

}  // namespace pf::test
