// Time in method `exact`: how long ticks are, at which an event comes, and what changes when they grow
// coarser.
#include <gtest/gtest.h>

#include <cmath>

#include "backend/backend.hpp"
#include "model/exact_plan.hpp"

namespace pf {
namespace {

ExactConstants constants(double reference_mps = 1.0, double clock_s = 0.0) {
  Physics physics;
  physics.world = make_world(10.0, 10.0, Boundary::periodic);
  physics.parcels = {100, 0.5, 1.0, 1.0, 0.5, 1.0, true};
  physics.reference_speed_mps = reference_mps;
  ExactConstants c = make_exact_constants(physics, clock_s);
  c.length = 1000;
  return c;
}

// So a place at a whole tick is off by a sixteenth of a unit at most, less than the rounding to a whole unit;
// and not by so little that ticks are wasted.
TEST(Ticks, TheReferenceSpeedCoversASixteenthToAnEighthOfAUnit) {
  for (const double mps : {1e-6, 0.3, 0.5, 1.0, 1.5, 2.0, 40.0, 1e5}) {
    const World world = make_world(13.4, 6.1, Boundary::open);
    const double covered = mps * tick_seconds(world, mps) / world.unit_m;
    EXPECT_LE(covered, 0.125 * (1.0 + 1e-15)) << mps;
    EXPECT_GT(covered, 0.0625 * (1.0 - 1e-15)) << mps;
  }
}

TEST(Ticks, AnEventComesAtTheNearestTick) {
  const ExactConstants c = constants();
  EXPECT_EQ(event_tick(c, 0, 2.4), 2U);
  EXPECT_EQ(event_tick(c, 0, 2.6), 3U);
  EXPECT_EQ(event_tick(c, -50, 60.7), 11U) << "of a line that was anchored before the step";
  EXPECT_EQ(event_tick(c, -50, 20.0), 0U) << "due before the step: at its begin";
  EXPECT_EQ(event_tick(c, 7, 992.4), 999U);
  EXPECT_EQ(event_tick(c, 7, 992.6), kNoTick) << "belongs to the next step";
  EXPECT_EQ(event_tick(c, 0, 1e300), kNoTick);
}

// What is coarsened: the same speeds, durations and distances, counted in ticks 2^k times as long.
TEST(Ticks, CoarserOnesKeepTheContactDurationAndTheLeastPartingSpeedOfTheirSpeed) {
  const double clock_s = 0.3;
  const ExactConstants base = constants(1.0, clock_s);
  for (const std::uint32_t coarse : {1U, 5U, 12U}) {
    const ExactConstants c = coarsened(base, coarse);
    EXPECT_EQ(c.tick_s, std::ldexp(base.tick_s, static_cast<int>(coarse)));
    EXPECT_EQ(c.units_per_tick * c.step.physics.reference_speed_mps, base.units_per_tick);
    EXPECT_GE(c.clock_ticks * c.tick_s, clock_s);
    EXPECT_LE(c.clock_ticks * c.tick_s, clock_s + 2.0 * c.tick_s) << "rounded up to a tick";
    EXPECT_EQ(c.least_parting_mps / c.step.physics.reference_speed_mps, base.least_parting_mps)
        << "a pair of a gas so cold parts at a speed that it has";
  }
  EXPECT_EQ(coarsened(constants(), 9).clock_ticks, 0U) << "no clock stays none";
}

// A clock that has run for some time has run for that time in other ticks, too: up to one of these more.
TEST(Ticks, AContactClockIsAsOldInOtherTicks) {
  const std::uint64_t now = 40ULL << 30U;
  for (const std::uint64_t age : {0ULL, 1ULL, 999ULL, 1ULL << 20U}) {
    const std::uint32_t clock = static_cast<std::uint32_t>(now) - static_cast<std::uint32_t>(age);
    const std::uint32_t coarser = clock_in_ticks(clock, now, 0, 4);
    const std::uint64_t coarse_age = static_cast<std::uint32_t>(now >> 4U) - coarser;
    EXPECT_EQ(coarse_age, (age + 15) / 16) << age;
    const std::uint32_t back = clock_in_ticks(coarser, now, 4, 0);
    EXPECT_EQ(static_cast<std::uint32_t>(now) - back, (age + 15) / 16 * 16) << age;
  }
}

// The speeds of a gas that cooled are told as finely as those of a fresh one, relative to them: what was the
// fastest covers at most an eighth of a unit per tick, a 32nd at least.
TEST(Ticks, GrowWithTheSlownessOfTheGas) {
  const ExactConstants base = constants();
  std::uint32_t coarse = 0;
  for (double fastest_mps = 1.0; fastest_mps > 1e-5; fastest_mps *= 0.7) {
    const std::uint32_t before = coarse;
    coarse = suitable_coarseness(base, coarse, fastest_mps);
    const double covered = fastest_mps * coarsened(base, coarse).units_per_tick;
    EXPECT_LE(covered, 0.125 * (1.0 + 1e-15)) << fastest_mps;
    EXPECT_GE(covered, 0.125 / 64.0) << fastest_mps;
    if (coarse != before) {
      EXPECT_GE(covered, 0.125 / 4.0) << fastest_mps;
      EXPECT_LE(covered, 0.125 / 2.0) << "with room for those that become faster";
    }
  }
  EXPECT_GT(coarse, 10U);
}

// A step ends at the tick that was asked for, or before.
TEST(Ticks, AStepEndsWhenItIsAskedTo) {
  ExactConstants c = constants();
  ExactProgress progress;
  progress.fastest_mps = 1.0;
  progress.preferred_ticks = 1e9;
  for (const std::uint64_t ticks : {1ULL, 2ULL, 777ULL, 100000ULL}) {
    progress.now = 12345;
    plan_step(progress, progress.now + ticks, kAnchorPeriod, c);
    EXPECT_EQ(c.length, ticks);
    EXPECT_EQ(c.begin, 12345U);
  }
  c = coarsened(constants(), 3);
  progress.coarse = 3;
  progress.now = 8000;
  plan_step(progress, 8001, kAnchorPeriod, c);
  EXPECT_EQ(c.length, 1U) << "the tick in which the asked one lies";
  plan_step(progress, 8009, kAnchorPeriod, c);
  EXPECT_EQ(c.length, 2U);
}

}  // namespace
}  // namespace pf
