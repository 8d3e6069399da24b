// The plan of a sweep: sizes, frames, extrapolation, and the flags. test_program.py tests the sweep itself.
#include <gtest/gtest.h>

#include <set>

#include "app/options.hpp"
#include "app/sweep_plan.hpp"
#include "core/error.hpp"

namespace pf {
namespace {

using Sizes = std::vector<std::int64_t>;

TEST(SweepPlan, SizesArePowersOfTenAndTheMaximum) {
  EXPECT_EQ(sweep_sizes(1000), Sizes({1000}));
  EXPECT_EQ(sweep_sizes(1'000'000), Sizes({1000, 10'000, 100'000, 1'000'000}));
  EXPECT_EQ(sweep_sizes(25'000), Sizes({1000, 10'000, 25'000}));
}

TEST(SweepPlan, HasEverySeriesOnce) {
  std::set<std::string> names;
  int cuda = 0, all_pairs = 0;
  for (const SweepSeries& series : sweep_series()) {
    names.insert(series.name);
    cuda += series.cuda;
    all_pairs += series.neighbors == Neighbors::all_pairs;
  }
  EXPECT_EQ(names.size(), 6U);
  EXPECT_EQ(cuda, 2);
  EXPECT_EQ(all_pairs, 3);
}

TEST(SweepPlan, AllPairsGrowsWithTheSquare) {
  const FrameCost cost = {2.0, 3.0, 5.0};
  const FrameCost pairs = scaled_cost(cost, 1000, 10'000, Neighbors::all_pairs);
  EXPECT_DOUBLE_EQ(pairs.physics_ms, 200.0);
  EXPECT_DOUBLE_EQ(pairs.render_ms, 30.0);
  EXPECT_DOUBLE_EQ(pairs.overhead_ms, 50.0);
  const FrameCost grid = scaled_cost(cost, 1000, 10'000, Neighbors::grid);
  EXPECT_DOUBLE_EQ(grid.physics_ms, 20.0);
  EXPECT_DOUBLE_EQ(grid.total_ms(), 100.0);
}

// Measured points take at most 20 s: 4 frames of 5 s do, 4 frames of 5.1 s do not.
TEST(SweepPlan, SlowPointsGetFewFramesOrNone) {
  const auto frames_at = [](double frame_ms) { return plan_frames(FrameCost{frame_ms, 0.0, 0.0}); };
  EXPECT_EQ(plan_frames(std::nullopt)->timed, 60);
  EXPECT_EQ(plan_frames(std::nullopt)->warmup, 10);
  EXPECT_EQ(frames_at(1.0)->timed, 60);
  EXPECT_EQ(frames_at(0.0)->timed, 60);
  EXPECT_EQ(frames_at(5000.0)->timed, 3);
  EXPECT_EQ(frames_at(5000.0)->warmup, 1);
  EXPECT_FALSE(frames_at(5100.0).has_value());
  for (double frame_ms = 1.0; frame_ms < 5000.0; frame_ms *= 1.3) {
    const FrameCount count = frames_at(frame_ms).value();
    EXPECT_LE((count.warmup + count.timed) * frame_ms, 20'000.0) << frame_ms;
    EXPECT_GE(count.warmup, 1) << frame_ms;
  }
}

Options parse(std::vector<const char*> words) {
  words.insert(words.begin(), "pickleflight");
  return parse_options(static_cast<int>(words.size()), words.data()).options.value();
}

TEST(SweepFlags, Parse) {
  EXPECT_FALSE(parse({"bench"}).sweep);
  EXPECT_TRUE(parse({"bench", "--sweep"}).sweep);
  EXPECT_EQ(parse({"bench", "--sweep"}).sweep_max, 1'000'000);
  EXPECT_EQ(parse({"bench", "--sweep", "--sweep-max", "5000"}).sweep_max, 5000);
  EXPECT_EQ(parse({"run", "--warmup", "7"}).warmup_frames, 7);
  EXPECT_EQ(parse({"run", "--warmup", "7"}).bench_warmup, 20);
  EXPECT_EQ(parse({"bench", "--warmup", "7"}).bench_warmup, 7);
}

TEST(SweepFlags, RejectsOptionsThatSweepsIgnore) {
  EXPECT_THROW(parse({"bench", "--sweep-max", "5000"}), UserError);
  EXPECT_THROW(parse({"bench", "--sweep", "--sweep-max", "999"}), UserError);
  EXPECT_THROW(parse({"bench", "--sweep", "-p", "500"}), UserError);
  EXPECT_THROW(parse({"bench", "--sweep", "--scene", "gas"}), UserError);
  EXPECT_THROW(parse({"bench", "--sweep", "--set", "air.restitution=1"}), UserError);
  EXPECT_THROW(parse({"bench", "--sweep", "--steps", "5"}), UserError);
}

}  // namespace
}  // namespace pf
