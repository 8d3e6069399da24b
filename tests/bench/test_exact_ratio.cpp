// Method `exact` on the CPU against the lab's serial event-driven reference: parallel steps must be faster.
#include <gtest/gtest.h>

#include <cstdio>
#include <thread>

#include "app/scene_run.hpp"
#include "bench/undisturbed.hpp"
#include "core/statistics.hpp"
#include "core/timing.hpp"
#include "lab/reference.hpp"

namespace pf::test {
namespace {

constexpr std::int64_t kExactNum = 100000;
constexpr double kExactAreaFraction = 0.2;
constexpr double kTime_s = 0.7;  // 0.9 collisions per disc
constexpr int kExactRepeats = 5;

Reference reference_of(SceneRun& run) {
  const ParcelSnapshot start = run.backend->snapshot();
  std::vector<ReferenceParcel> parcels(start.position.size());
  for (std::size_t i = 0; i < parcels.size(); ++i) {
    parcels[i].position_m = to_metres(run.physics.world, start.position[i]);
    parcels[i].velocity_mps = to_double(start.velocity[i]);
  }
  return {run.physics, parcels, run.ball};
}

TEST(BenchRatio, ExactIsFasterThanTheSerialReference) {
  if (!PF_IS_OPTIMISED) GTEST_SKIP() << "times only a Release build without sanitizers";
  if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "needs 2 cores; this machine has fewer";
  Settings settings = unit_gas(kExactNum, kExactAreaFraction, Boundary::periodic);
  settings.method = Method::exact;
  SceneRun run(settings, 2);
  run.advance(1, 5.0 * kTime_s);  // the starting lattice melts
  Reference rival = reference_of(run);
  const MachineLoad load;
  std::vector<double> per_s[2];  // collisions per second: exact, reference
  for (int repeat = 0; repeat < kExactRepeats; ++repeat) {
    Clock::time_point start = Clock::now();
    const auto exact = static_cast<double>(run.advance(1, kTime_s).totals.num_collisions);
    per_s[0].push_back(exact / (1e-3 * milliseconds_since(start)));
    const auto before = static_cast<double>(rival.totals().num_collisions);
    start = Clock::now();
    ASSERT_TRUE(rival.run_until(rival.now_s() + kTime_s));
    const double reference = static_cast<double>(rival.totals().num_collisions) - before;
    per_s[1].push_back(reference / (1e-3 * milliseconds_since(start)));
    // Both step the same gas: 9e4 collisions, 4 sigma of the difference.
    EXPECT_NEAR(exact / reference, 1.0, 0.02);
  }
  const double exact_per_s = median_of(per_s[0]), reference_per_s = median_of(per_s[1]);
  const double ratio = exact_per_s / reference_per_s;
  std::printf(
      "million collisions per second, median: exact, 2 threads %.3f; reference, 1 thread %.3f; ratio %.2f\n",
      1e-6 * exact_per_s, 1e-6 * reference_per_s, ratio);
  constexpr double kMin = 1.8;  // measured: 2.5 to 4.2 on a Xeon, 3.8 to 6.4 on an EPYC, two threads each
  const std::string disturbed = disturbance(load);
  if (ratio < kMin && !disturbed.empty()) GTEST_SKIP() << disturbed;
  EXPECT_GE(ratio, kMin);
}

}  // namespace
}  // namespace pf::test
