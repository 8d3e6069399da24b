// The CPU backend against plain_stepper: it must stay ahead in spite of determinism and accuracy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>

#include "backend/time_step/paired_loop.hpp"
#include "bench/plain_stepper.hpp"
#include "bench/undisturbed.hpp"
#include "core/statistics.hpp"
#include "core/timing.hpp"
#include "model/kinetic_theory.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

constexpr std::int64_t kNum = 100000;
constexpr double kAreaFraction = 0.2;
constexpr double kDt_s = 0.035;
constexpr int kWarmUpSteps = 100;  // 4.5 collisions per disc melt the starting lattice
constexpr int kRepeats = 9;

// The rival starts from the backend's state: both do the same work.
PlainStepper rival_of(SceneRun& run) {
  const World& world = run.physics.world;
  const double diameter_m = 2.0 * run.physics.parcels.radius_m;
  const Vec2d half_m = to_metres(world, world.half);
  const ParcelSnapshot start = run.backend->snapshot();
  PlainDiscs discs(start.position.size());
  for (std::size_t i = 0; i < discs.num(); ++i) {
    const Vec2d corner_m = to_metres(world, start.position[i]) + half_m;
    discs.x[i] = static_cast<float>(corner_m.x / diameter_m);
    discs.y[i] = static_cast<float>(corner_m.y / diameter_m);
    discs.vx[i] = static_cast<float>(start.velocity[i].x / diameter_m);
    discs.vy[i] = static_cast<float>(start.velocity[i].y / diameter_m);
  }
  return {static_cast<float>(2.0 * half_m.x / diameter_m), std::move(discs)};
}

void advance(PlainStepper& plain, int steps) {
  for (int i = 0; i < steps; ++i) plain.step(static_cast<float>(kDt_s));
}

double mean_square_speed_per_component(const PlainDiscs& discs) {
  double sum = 0.0;
  for (std::size_t i = 0; i < discs.num(); ++i) {
    sum += static_cast<double>(discs.vx[i]) * discs.vx[i] + static_cast<double>(discs.vy[i]) * discs.vy[i];
  }
  return sum / (2.0 * static_cast<double>(discs.num()));
}

template <class Work>
double ns_of(Work work) {
  const Clock::time_point start = Clock::now();
  work();
  return 1e6 * milliseconds_since(start);
}

double minimum(const std::vector<double>& values) { return *std::min_element(values.begin(), values.end()); }

// 100,000 discs x 10.5 time units x 1.29 collisions have a statistical error of 0.1 %. The rest of the 3 % is
// for the walls and for contacts that are found half a step late and pushed out.
TEST(BenchRatio, PlainStepperCollidesAtEnskogsRate) {
  SceneRun run(gas(kNum, kAreaFraction), 1);
  PlainStepper plain = rival_of(run);
  advance(plain, kWarmUpSteps);
  const std::uint64_t collisions_before = plain.num_collisions();
  const double c2_before = mean_square_speed_per_component(plain.discs());
  const int steps = 300;
  advance(plain, steps);
  const double c = std::sqrt(0.5 * (c2_before + mean_square_speed_per_component(plain.discs())));
  const auto collisions = static_cast<double>(plain.num_collisions() - collisions_before);
  const double rate = 2.0 * collisions / (static_cast<double>(kNum) * steps * kDt_s);
  const double ratio = rate / enskog_rate_per_s(kAreaFraction, c, 0.5);
  std::printf("plain stepper: %.4f collisions per disc and second, %.4f of Enskog's\n", rate, ratio);
  EXPECT_NEAR(ratio, 1.0, 0.03);
}

// Nanoseconds per disc-step of the rival over those of the backend, medians. Both take turns, so that a slow
// phase of the machine affects both.
double ratio_of(std::int64_t num, unsigned num_threads) {
  SceneRun run(gas(num, kAreaFraction), num_threads);
  PlainStepper plain = rival_of(run);
  advance(plain, kWarmUpSteps);
  run.advance(kWarmUpSteps, kDt_s);
  const int steps = num > kNum ? 20 : 60;  // of a timing: several sorts
  const double per_disc_step = 1.0 / (static_cast<double>(num) * steps);
  std::vector<double> plain_ns, backend_ns;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    plain_ns.push_back(per_disc_step * ns_of([&] { advance(plain, steps); }));
    backend_ns.push_back(per_disc_step *
                         ns_of([&] { run.advance(static_cast<std::uint32_t>(steps), kDt_s); }));
  }
  std::printf("ns per disc-step, median (minimum): plain %.2f (%.2f); backend, threads: %u, %.2f (%.2f)\n",
              median_of(plain_ns), minimum(plain_ns), num_threads, median_of(backend_ns),
              minimum(backend_ns));
  return median_of(plain_ns) / median_of(backend_ns);
}

class OneThread : public testing::TestWithParam<std::int64_t> {};

TEST_P(OneThread, IsTwoAndAHalfTimesAsFastAsThePlainStepper) {
  if (!PF_IS_OPTIMISED) GTEST_SKIP() << "times only a Release build without sanitizers";
  if (!PairedLoop::is_supported()) GTEST_SKIP() << "this processor lacks AVX2";
  EXPECT_GE(ratio_of(GetParam(), 1), 2.5);
}

INSTANTIATE_TEST_SUITE_P(BenchRatio, OneThread, testing::Values(kNum, 10 * kNum));

TEST(BenchRatio, TwoThreadsAreTwiceAsFastAsThePlainStepper) {
  if (!PF_IS_OPTIMISED) GTEST_SKIP() << "times only a Release build without sanitizers";
  if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "needs 2 cores; this machine has fewer";
  constexpr double kMin = 2.0;
  const MachineLoad load;
  const double ratio = ratio_of(kNum, 2);
  const std::string disturbed = disturbance(load);  // slows down two threads, but not one
  if (ratio < kMin && !disturbed.empty()) GTEST_SKIP() << "ratio " << ratio << "; " << disturbed;
  EXPECT_GE(ratio, kMin);
}

}  // namespace
}  // namespace pf::test
