// Other programs on the same processors take their share of time, but must not make our threads wait for each
// other: beside them two threads must not be much slower than one.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <thread>
#include <vector>

#include "bench/busy_processes.hpp"
#include "core/statistics.hpp"
#include "core/timing.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

double median_ms_of_frame(SceneRun& run) {
  constexpr int kFrames = 25;
  constexpr std::uint32_t kSteps = 8;
  std::vector<double> times;
  for (int frame = 0; frame < kFrames; ++frame) {
    const Clock::time_point start = Clock::now();
    run.advance(kSteps);
    times.push_back(milliseconds_since(start));
  }
  return median_of(times);
}

// On two processors of an EPYC the ratio is 1.0 to 1.2, and mostly 11 to 42 if the calling thread waits for
// the other, whatever that does.
TEST(BusyMachine, ThreadsDoNotWaitForEachOther) {
  Settings settings = unit_gas(20000, 0.2, Boundary::walls);
  settings.method = Method::impulse;
  SceneRun one(settings, 1), two(settings, 2);
  one.advance(20);
  two.advance(20);
  std::array<double, 3> ratios;
  // Two for each processor: with one a processor may have none for a while.
  const BusyProcesses others(2 * std::thread::hardware_concurrency());
  for (double& ratio : ratios) {
    const double two_ms = median_ms_of_frame(two), one_ms = median_ms_of_frame(one);
    ratio = two_ms / one_ms;
    std::printf("frame beside busy processes: %.2f ms with two threads, %.2f with one\n", two_ms, one_ms);
  }
  std::sort(ratios.begin(), ratios.end());
  EXPECT_LT(ratios[1], 4.0);
}

}  // namespace
}  // namespace pf::test
