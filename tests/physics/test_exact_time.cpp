// Time in method `exact`: the length of ticks, the tick of an event, longer ticks in a gas that cools, and
// the length of steps.
#include <gtest/gtest.h>

#include <cmath>

#include "backend/backend.hpp"
#include "model/exact/step_plan.hpp"

namespace pf {
namespace {

constexpr double kReferenceSpeed_mps = 1.0;

RunConstants run_constants(double contact_duration_s = 0.0) {
  Physics physics;
  physics.world = make_world(10.0, 10.0, Boundary::periodic);
  physics.parcels = {100, 0.5, 1.0, 1.0, 0.5, 1.0, true};
  physics.reference_speed_mps = kReferenceSpeed_mps;
  return make_run_constants(physics, contact_duration_s);
}

StepPlan plan_of(const RunConstants& run) {
  StepPlan plan;
  static_cast<TickScale&>(plan) = run.reference_ticks;
  plan.length = 1000;
  return plan;
}

// A position at a whole tick is then off by at most a sixteenth of a unit, less than by rounding to a whole
// unit. Much shorter ticks would be wasted.
TEST(Ticks, TheReferenceSpeedCoversASixteenthToAnEighthOfAUnit) {
  for (const double mps : {1e-6, 0.3, 0.5, 1.0, 1.5, 2.0, 40.0, 1e5}) {
    const World world = make_world(13.4, 6.1, Boundary::open);
    const double covered = mps * tick_seconds(world, mps) / world.unit_m;
    EXPECT_LE(covered, 0.125 * (1.0 + 1e-15)) << mps;
    EXPECT_GT(covered, 0.0625 * (1.0 - 1e-15)) << mps;
  }
}

TEST(Ticks, EventsComeAtTheNearestTick) {
  const StepPlan plan = plan_of(run_constants());
  EXPECT_EQ(event_tick(plan, 0, 2.4), 2U);
  EXPECT_EQ(event_tick(plan, 0, 2.6), 3U);
  EXPECT_EQ(event_tick(plan, -50, 60.7), 11U) << "of a trajectory that was anchored before the step";
  EXPECT_EQ(event_tick(plan, -50, 20.0), 0U) << "due before the step: at its start";
  EXPECT_EQ(event_tick(plan, 7, 992.4), 999U);
  EXPECT_EQ(event_tick(plan, 7, 992.6), kNoTick) << "belongs to the next step";
  EXPECT_EQ(event_tick(plan, 0, 1e300), kNoTick);
}

// The same durations and relative speeds, counted in ticks 2^k times as long.
TEST(Ticks, LongerTicksKeepContactDurationAndRelativeSeparationSpeeds) {
  const double duration_s = 0.3;
  const TickScale reference = run_constants(duration_s).reference_ticks;
  for (const std::uint32_t exponent : {1U, 5U, 12U}) {
    const TickScale scale = scaled(reference, exponent);
    EXPECT_EQ(scale.tick_s, std::ldexp(reference.tick_s, static_cast<int>(exponent)));
    EXPECT_EQ(scale.reference_speed_mps, std::ldexp(kReferenceSpeed_mps, -static_cast<int>(exponent)));
    EXPECT_EQ(scale.units_per_tick * scale.reference_speed_mps, reference.units_per_tick);
    EXPECT_GE(scale.contact_duration_ticks * scale.tick_s, duration_s);
    EXPECT_LE(scale.contact_duration_ticks * scale.tick_s, duration_s + 2.0 * scale.tick_s)
        << "rounded up to a tick";
    EXPECT_EQ(scale.min_separation_speed_mps / scale.reference_speed_mps, reference.min_separation_speed_mps)
        << "relative to the speeds in a gas so cold";
    EXPECT_GT(scale.separation_mps_per_unit, 0.0);
    EXPECT_EQ(scale.separation_mps_per_unit * scale.tick_s,
              reference.separation_mps_per_unit * reference.tick_s)
        << "overlaps are undone in as many ticks";
  }
  EXPECT_EQ(scaled(run_constants().reference_ticks, 9).contact_duration_ticks, 0U) << "none stays none";
}

// Search boxes hold every parcel that has moved since the sort, by three roundings a step as well.
TEST(Progress, AStepAddsThePathOfTheFastestParcel) {
  const RunConstants run = run_constants();
  const ExactConstants c{run, plan_of(run)};
  const double path = 5.0 * c.plan.units_per_tick * c.plan.length;
  for (const bool is_slowed : {false, true}) {
    ExactProgress progress;
    progress.fastest_mps = is_slowed ? 5.0 : 3.0;
    progress.max_displacement = 100;
    StepResult result;
    result.fastest_at_start_mps = 3.0;
    result.fastest_after_mps = is_slowed ? 2.0 : 5.0;
    advance_progress(c, result, progress);
    EXPECT_GE(static_cast<double>(progress.max_displacement), 100.0 + path);
    EXPECT_LE(static_cast<double>(progress.max_displacement), 100.0 + path + 3.0);
    EXPECT_EQ(progress.fastest_mps, is_slowed ? 3.0 : 5.0) << "from now on";
    EXPECT_EQ(progress.now, c.plan.length);
  }
}

// The age of a contact stays the same in other ticks, rounded up to one of them.
TEST(Ticks, RescalingKeepsTheAgeOfAContact) {
  const std::uint64_t now = 40ULL << 30U;
  for (const std::uint64_t age : {0ULL, 1ULL, 999ULL, 1ULL << 20U}) {
    const auto last_contact_tick = static_cast<std::uint32_t>(now) - static_cast<std::uint32_t>(age);
    const std::uint32_t longer = rescaled_contact_tick(last_contact_tick, now, 0, 4);
    const std::uint64_t age_in_longer = static_cast<std::uint32_t>(now >> 4U) - longer;
    EXPECT_EQ(age_in_longer, (age + 15) / 16) << age;
    const std::uint32_t back = rescaled_contact_tick(longer, now, 4, 0);
    EXPECT_EQ(static_cast<std::uint32_t>(now) - back, (age + 15) / 16 * 16) << age;
  }
}

// Ticks resolve the speeds of a gas that has cooled as finely as those of a fresh one: the fastest parcel
// covers between a 64th and an eighth of a unit per tick.
TEST(Ticks, GrowAsTheGasCools) {
  const TickScale reference = run_constants().reference_ticks;
  std::uint32_t exponent = 0;
  for (double fastest_mps = 1.0; fastest_mps > 1e-5; fastest_mps *= 0.7) {
    const std::uint32_t before = exponent;
    exponent = choose_tick_exponent(reference, exponent, fastest_mps);
    const double covered = fastest_mps * scaled(reference, exponent).units_per_tick;
    EXPECT_LE(covered, 0.125 * (1.0 + 1e-15)) << fastest_mps;
    EXPECT_GE(covered, 0.125 / 64.0) << fastest_mps;
    if (exponent != before) {
      EXPECT_GE(covered, 0.125 / 4.0) << fastest_mps;
      EXPECT_LE(covered, 0.125 / 2.0) << "leaves room for parcels that become faster";
    }
  }
  EXPECT_GT(exponent, 10U);
}

TEST(Steps, EndAtTheRequestedTick) {
  const RunConstants run = run_constants();
  ExactProgress progress;
  progress.fastest_mps = 1.0;
  progress.preferred_ticks = 1e9;
  for (const std::uint64_t ticks : {1ULL, 2ULL, 777ULL, 100000ULL}) {
    progress.now = 12345;
    const StepPlan plan = plan_step(run, progress, progress.now + ticks, kAnchorPeriod);
    EXPECT_EQ(plan.length, ticks);
    EXPECT_EQ(plan.start, 12345U);
  }
  progress.tick_exponent = 3;
  progress.now = 8000;
  EXPECT_EQ(plan_step(run, progress, 8001, kAnchorPeriod).length, 1U) << "the tick that contains it";
  EXPECT_EQ(plan_step(run, progress, 8009, kAnchorPeriod).length, 2U);
}

// Two bodies whose displacements in a step add up to at most half the world's width, less their contact
// distance, can collide only as nearest images. In other worlds search boxes must stay within 32 bits.
TEST(Steps, AreSoShortThatOnlyNearestImagesCollide) {
  for (const double height_m : {10.0, 3.0, 2.2}) {
    for (const double mps : {1.0, 300.0}) {
      RunConstants run = run_constants();
      run.physics.world = make_world(10.0, height_m, Boundary::periodic);
      ExactConstants c{run, plan_of(run)};
      c.plan.max_speed_mps = mps;
      const double both_per_tick = 2.0 * mps * c.plan.units_per_tick;
      const double displacements = both_per_tick * max_step_ticks(c, 0);
      EXPECT_LE(displacements, run.physics.world.half.y - run.contact_distance) << height_m;
      EXPECT_LE(displacements + run.contact_distance, kMaxReach);
      EXPECT_LE(both_per_tick * max_step_ticks(c, 100'000'000) + 1e8, kMaxReach);
    }
  }
}

// A parcel much faster than the reference speed goes round a periodic world between its anchor and the step.
// The nearest image at the step's start counts, not the one that was nearest at the anchor. All numbers are
// whole.
TEST(CollisionTick, UsesNearestImagesAtTheStepsStart) {
  const RunConstants run = run_constants();
  ExactConstants c{run, plan_of(run)};
  c.plan.start = 1U << 25U;
  constexpr std::uint32_t kAge = 1U << 20U;
  const Trajectory resting{{0, 0}, {0.0F, 0.0F}, c.plan.start - kAge};
  for (const int units : {8, 700, 1434, 5000}) {  // per tick
    ASSERT_EQ(units * 8 * c.plan.units_per_tick, units);
    for (const int side : {1, -1}) {
      const double at_start = side * (std::ceil(run.contact_distance) + 100.0 * units);
      const double at_anchor = at_start + side * static_cast<double>(units) * kAge;
      const std::int32_t x = confined<Boundary::periodic>(static_cast<std::int64_t>(at_anchor), kHalfSide, 0);
      const Trajectory coming{{x, 0}, {-8.0F * static_cast<float>(side * units), 0.0F}, c.plan.start - kAge};
      EXPECT_EQ(collision_tick<Boundary::periodic>(c, resting, coming), 100U) << units << " units per tick";
      EXPECT_EQ(collision_tick<Boundary::periodic>(c, coming, resting), 100U) << units << " units per tick";
    }
  }
}

// The same order on every machine: by tick, then by generation, then by the partner's id; parcels before
// walls, walls before the ball.
TEST(EventOrder, IsByTickThenByGenerationThenByThePartnersId) {
  const Event early{5, 9, 90, 7}, low{6, 9, 3}, high{6, 1, 4}, wall{6, kWallX, kWallX},
      ball{6, kBallPartner, kBallPartner}, caused{6, 2, 1, 1};
  const Event* in_order[] = {&early, &low, &high, &wall, &ball, &caused};
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) EXPECT_EQ(comes_before(*in_order[i], *in_order[k]), i < k) << i << ", " << k;
  }
  Event best;
  for (const Event* event : {&caused, &ball, &low, &wall, &early, &high}) keep_earlier(best, *event);
  EXPECT_EQ(best.partner_id, early.partner_id);
}

}  // namespace
}  // namespace pf
