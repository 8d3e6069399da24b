// Time in method `exact`: how long ticks are, at which an event comes, and what changes when they grow
// coarser.
#include <gtest/gtest.h>

#include <cmath>

#include "backend/backend.hpp"
#include "model/exact/step_plan.hpp"

namespace pf {
namespace {

ExactConstants constants(double reference_mps = 1.0, double clock_s = 0.0) {
  Physics physics;
  physics.world = make_world(10.0, 10.0, Boundary::periodic);
  physics.parcels = {100, 0.5, 1.0, 1.0, 0.5, 1.0, true};
  physics.reference_speed_mps = reference_mps;
  ExactConstants c = make_exact_constants(physics, clock_s);
  c.plan.length = 1000;
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
  for (const std::uint32_t tick_exponent : {1U, 5U, 12U}) {
    const ExactConstants c = with_tick_exponent(base, tick_exponent);
    EXPECT_EQ(c.plan.tick_s, std::ldexp(base.tick_s, static_cast<int>(tick_exponent)));
    EXPECT_EQ(c.plan.units_per_tick * c.run.physics.reference_speed_mps, base.units_per_tick);
    EXPECT_GE(c.plan.contact_duration_ticks * c.plan.tick_s, clock_s);
    EXPECT_LE(c.plan.contact_duration_ticks * c.plan.tick_s, clock_s + 2.0 * c.plan.tick_s) << "rounded up to a tick";
    EXPECT_EQ(c.plan.min_separation_speed_mps / c.run.physics.reference_speed_mps, base.min_separation_speed_mps)
        << "a pair of a gas so cold parts at a speed that it has";
  }
  EXPECT_EQ(with_tick_exponent(constants(), 9).contact_duration_ticks, 0U) << "no clock stays none";
}

// A clock that has run for some time has run for that time in other ticks, too: up to one of these more.
TEST(Ticks, AContactClockIsAsOldInOtherTicks) {
  const std::uint64_t now = 40ULL << 30U;
  for (const std::uint64_t age : {0ULL, 1ULL, 999ULL, 1ULL << 20U}) {
    const std::uint32_t last_contact_tick = static_cast<std::uint32_t>(now) - static_cast<std::uint32_t>(age);
    const std::uint32_t coarser = contact_tick_in_units(last_contact_tick, now, 0, 4);
    const std::uint64_t coarse_age = static_cast<std::uint32_t>(now >> 4U) - coarser;
    EXPECT_EQ(coarse_age, (age + 15) / 16) << age;
    const std::uint32_t back = contact_tick_in_units(coarser, now, 4, 0);
    EXPECT_EQ(static_cast<std::uint32_t>(now) - back, (age + 15) / 16 * 16) << age;
  }
}

// The speeds of a gas that cooled are told as finely as those of a fresh one, relative to them: what was the
// fastest covers at most an eighth of a unit per tick, a 32nd at least.
TEST(Ticks, GrowWithTheSlownessOfTheGas) {
  const ExactConstants base = constants();
  std::uint32_t tick_exponent = 0;
  for (double fastest_mps = 1.0; fastest_mps > 1e-5; fastest_mps *= 0.7) {
    const std::uint32_t before = tick_exponent;
    tick_exponent = choose_tick_exponent(base, tick_exponent, fastest_mps);
    const double covered = fastest_mps * with_tick_exponent(base, tick_exponent).units_per_tick;
    EXPECT_LE(covered, 0.125 * (1.0 + 1e-15)) << fastest_mps;
    EXPECT_GE(covered, 0.125 / 64.0) << fastest_mps;
    if (tick_exponent != before) {
      EXPECT_GE(covered, 0.125 / 4.0) << fastest_mps;
      EXPECT_LE(covered, 0.125 / 2.0) << "with room for those that become faster";
    }
  }
  EXPECT_GT(tick_exponent, 10U);
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
    EXPECT_EQ(c.plan.length, ticks);
    EXPECT_EQ(c.plan.start, 12345U);
  }
  c = with_tick_exponent(constants(), 3);
  progress.tick_exponent = 3;
  progress.now = 8000;
  plan_step(progress, 8001, kAnchorPeriod, c);
  EXPECT_EQ(c.plan.length, 1U) << "the tick in which the asked one lies";
  plan_step(progress, 8009, kAnchorPeriod, c);
  EXPECT_EQ(c.plan.length, 2U);
}

// Two bodies that move by half the world's width less their contact distance, together, within a step can
// meet only at their nearest images. In other worlds search boxes must stay within 32 bits.
TEST(Ticks, AStepIsSoShortThatOnlyNearestImagesMeet) {
  for (const double height_m : {10.0, 3.0, 2.2}) {
    for (const double mps : {1.0, 300.0}) {
      ExactConstants c = constants();
      c.run.physics.world = make_world(10.0, height_m, Boundary::periodic);
      c.plan.max_speed_mps = mps;
      const double together = 2.0 * mps * c.plan.units_per_tick * max_step_ticks(c, 0);
      const double narrower = c.run.physics.world.half.y - c.run.contact_distance;
      EXPECT_LE(together, narrower) << height_m;
      EXPECT_LE(together + c.run.contact_distance, kMaxReach);
      EXPECT_LE(2.0 * mps * c.plan.units_per_tick * max_step_ticks(c, 100'000'000) + 1e8, kMaxReach);
    }
  }
}

// A parcel much faster than the reference speed goes round a periodic world between its anchor and the step:
// whom it meets is decided where they are then, not by whose image was the nearest long before. All numbers
// are whole.
TEST(Meeting, IsOfTheNearestImagesAtTheStepsBegin) {
  ExactConstants c = constants();
  c.plan.start = 1U << 25U;
  constexpr std::uint32_t kAge = 1U << 20U;
  const Trajectory rests{{0, 0}, {0.0F, 0.0F}, c.plan.start - kAge};
  for (const int units : {8, 700, 1434, 5000}) {  // per tick
    ASSERT_EQ(units * 8 * c.plan.units_per_tick, units);
    for (const int side : {1, -1}) {
      const double at_begin = side * (std::ceil(c.run.contact_distance) + 100.0 * units);
      const double at_anchor = at_begin + side * static_cast<double>(units) * kAge;
      const std::int32_t x = settled<Boundary::periodic>(static_cast<std::int64_t>(at_anchor), kHalfSide, 0);
      const Trajectory comes{{x, 0}, {-8.0F * static_cast<float>(side * units), 0.0F}, c.plan.start - kAge};
      EXPECT_EQ(collision_tick<Boundary::periodic>(c, rests, comes), 100U) << units << " units per tick";
      EXPECT_EQ(collision_tick<Boundary::periodic>(c, comes, rests), 100U) << units << " units per tick";
    }
  }
}

// The convention that makes a run's events the same on every machine: by tick, then by the partner's number,
// parcels before walls before the ball.
TEST(Meeting, OfEventsAtOneTickThatWithTheLowerNumberComesFirst) {
  const Event early{5, 9, 90}, low{6, 9, 3}, high{6, 1, 4}, wall{6, kWallX, kWallX},
      ball{6, kBallPartner, kBallPartner};
  const Event* in_order[] = {&early, &low, &high, &wall, &ball};
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 5; ++k) EXPECT_EQ(comes_before(*in_order[i], *in_order[k]), i < k) << i << ", " << k;
  }
  Event best;
  for (const Event* event : {&ball, &low, &wall, &early, &high}) keep_earlier(best, *event);
  EXPECT_EQ(best.partner_id, early.partner_id);
}

}  // namespace
}  // namespace pf
