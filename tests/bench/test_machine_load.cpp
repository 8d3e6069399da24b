// The lab tells its own work from that of others. The test must run alone: other tests would count as others.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "bench/busy_processes.hpp"
#include "lab/machine_load.hpp"

namespace pf::test {
namespace {

void burn(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
  }
}

constexpr double kSeconds = 0.6;

double cores_while_this_process_works() {
  const MachineLoad load;
  burn(kSeconds);
  return load.cores_used_by_others();
}

double cores_while_processes_work(unsigned num) {
  const MachineLoad load;
  const BusyProcesses others(num);
  std::this_thread::sleep_for(std::chrono::duration<double>(kSeconds));
  return load.cores_used_by_others();
}

// Other processes of the machine are in both figures: only the difference counts. A load average would give
// both the same.
TEST(MachineLoad, CountsOnlyTheWorkOfOthers) {
  double difference = 0.0;
  for (int attempt = 0; attempt < 5 && difference < 0.5; ++attempt)
    difference = cores_while_processes_work(1) - cores_while_this_process_works();
  if (difference < 0.5 && cores_while_processes_work(0) + 0.5 > std::thread::hardware_concurrency())
    GTEST_SKIP() << "no processor is free: another process only takes its time from others";
  EXPECT_GT(difference, 0.5);
}

}  // namespace
}  // namespace pf::test
