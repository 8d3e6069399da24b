// Median and percentiles of measured values, and of the frames of a run.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numeric>
#include <vector>

#include "app/report.hpp"
#include "core/statistics.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

// The values 1 .. num, not in order.
std::vector<double> numbers_to(int num) {
  std::vector<double> values(static_cast<std::size_t>(num));
  std::iota(values.rbegin(), values.rend(), 1.0);
  return values;
}

TEST(Statistics, TheMedianOfAnEvenNumberIsTheMeanOfTheTwoInTheMiddle) {
  for (const auto& [num, median] : {std::pair(1, 1.0), {2, 1.5}, {3, 2.0}, {4, 2.5}, {101, 51.0}}) {
    std::vector<double> values = numbers_to(num);
    EXPECT_EQ(median_of(values), median) << num;
  }
}

TEST(Statistics, NinetyNineInAHundredDoNotExceedThePercentile) {
  for (const auto& [num, p99] : {std::pair(1, 1.0), {99, 99.0}, {100, 99.0}, {101, 100.0}, {1000, 990.0}}) {
    std::vector<double> values = numbers_to(num);
    EXPECT_EQ(median_and_p99(values).p99, p99) << num;
  }
}

TEST(Statistics, AShareDoesNotExceedItsValue) {
  for (const auto& [num, quarter] : {std::pair(1, 1.0), {2, 1.0}, {4, 1.0}, {5, 2.0}, {60, 15.0}}) {
    std::vector<double> values = numbers_to(num);
    EXPECT_EQ(value_of_share(values, 0.25), quarter) << num;
    EXPECT_EQ(value_of_share(values, 1.0), num);
  }
}

// A window may stay open for days: beyond a million frames only some of them are kept, evenly spaced.
TEST(Statistics, OfVeryManyFramesAreThoseOfAll) {
  SceneRun run(gas(100, 0.1), 1);
  RunRecord record(run.physics, run.backend->measure(), "d");
  constexpr int kNum = 2'500'000;
  PhaseTimes times;
  StepTotals step;
  step.num_steps = 1;
  for (int k = 0; k < kNum; ++k) {
    times[Phase::collide_integrate] = 1.0 + static_cast<double>(k) / kNum;
    record.add_frame(times, step, 0.01);
  }
  const nlohmann::json report = record.finish(run.settings, run.physics, *run.backend, {}, 0.0);
  EXPECT_NEAR(report["phase_ms"]["collide_integrate"]["median"], 1.5, 1e-5);
  EXPECT_NEAR(report["phase_ms"]["collide_integrate"]["p99"], 1.99, 1e-5);
  EXPECT_NEAR(report["ns_per_parcel_step"], 1.5e6 / 100.0, 1.0) << "of all frames";
  EXPECT_EQ(record.frame_report()["num"], kNum);
  EXPECT_NEAR(record.frame_report()["physics_ms"], 1.5, 1e-5);
}

TEST(Statistics, NoValuesGiveZeros) {
  EXPECT_EQ(median_and_p99({}).median, 0.0);
  EXPECT_EQ(median_and_p99({}).p99, 0.0);
}

}  // namespace
}  // namespace pf::test
