// Limits of method `exact`: conservation, invalid input, situations that stop other event-driven codes, the
// ball, and changes of method and radius during a run.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "core/error.hpp"
#include "exact/exact_support.hpp"
#include "model/kinetic_theory.hpp"
#include "support/unresolvable.hpp"

namespace pf::test {
namespace {

// Largest overlap of any two parcels, position units, from all pairs.
double largest_overlap_units(SceneRun& run) {
  const ParcelSnapshot snapshot = run.backend->snapshot();
  const World& world = run.physics.world;
  const double contact = 2.0 * run.physics.parcels.radius_m / world.unit_m;
  double min2 = 1e300;
  for (std::size_t i = 0; i < snapshot.position.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (is_retired(snapshot.position[i]) || is_retired(snapshot.position[j])) continue;
      const Vec2i offset = world.boundary == kPeriodic
                               ? separation<kPeriodic>(world, snapshot.position[i], snapshot.position[j])
                               : separation<kWalls>(world, snapshot.position[i], snapshot.position[j]);
      const Vec2d e = to_double(offset);
      min2 = std::min(min2, dot(e, e));
    }
  }
  return contact - std::sqrt(min2);
}

// Two positions and a tick are rounded; the relative part is for double arithmetic.
double overlap_bound_units(const SceneRun& run) {
  return 4.0 + 1e-6 * 2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m;
}

void expect_sound(SceneRun& run, const StepTotals& totals, std::uint64_t num_steps) {
  EXPECT_EQ(totals.num_invalid, 0U);
  EXPECT_EQ(totals.num_steps, num_steps);
  EXPECT_LE(largest_overlap_units(run), overlap_bound_units(run));
}

double collision_rate_per_s(const SceneRun& run) {
  return theory::collision_rate_per_s(area_fraction_of(run.physics), run.physics.parcels.speed_mps,
                                      run.physics.parcels.radius_m);
}

// ---- conservation

struct ConservedCase {
  int num;
  double area_fraction;
};
class Conserved : public testing::TestWithParam<ConservedCase> {};

// 10^4 collisions per parcel. Momentum is a random walk of steps of at most 6e-8.
TEST_P(Conserved, EnergyAndMomentum) {
  const auto [num, eta] = GetParam();
  SceneRun run(exact(gas(num, eta, kPeriodic)), 1);
  const Measures before = run.backend->measure();
  const double step_s = 0.1 / collision_rate_per_s(run);
  StepTotals totals;
  double overlap = 0.0;
  for (int k = 0; k < 100; ++k) {
    totals += run.advance(1000, step_s).totals;
    overlap = std::max(overlap, largest_overlap_units(run));
  }
  const Measures after = run.backend->measure();
  const double drift = (after.parcel_energy_j - before.parcel_energy_j) / num;
  const double momentum =
      length(after.momentum_kg_mps - before.momentum_kg_mps) / before.momentum_scale_kg_mps;
  const auto events = static_cast<double>(totals.num_collisions);
  std::printf(
      "N %d, eta %.2f, %.0f collisions per parcel: energy off by %.2g, momentum by %.2g, overlap %.2f "
      "units\n",
      num, eta, 2.0 * events / num, drift, momentum, overlap);
  EXPECT_GT(2.0 * events / num, 9e3);
  EXPECT_LT(std::fabs(drift), energy_bound_j(events) / num);
  EXPECT_LT(momentum, 6e-8 * std::sqrt(2.0 * events) / std::sqrt(num));
  EXPECT_LE(overlap, overlap_bound_units(run));
}

INSTANTIATE_TEST_SUITE_P(Gas, Conserved, testing::Values(ConservedCase{256, 0.2}, ConservedCase{64, 0.6}));

TEST(Exact, NothingOverlapsInADenseInelasticBox) {
  Settings s = exact(gas(500, 0.65, kWalls));
  s.restitution = 0.9;
  SceneRun run(s, 1);
  for (int k = 0; k < 20; ++k) {
    run.advance(7, 0.03);
    ASSERT_LE(largest_overlap_units(run), overlap_bound_units(run)) << k;
  }
}

// ---- bad input

// Velocities that are not finite are reported and do not affect the search for other parcels.
TEST(Exact, ReportsVelocitiesThatAreNotFinite) {
  const auto fly = [](float speed_mps) {
    SceneRun run(exact(gas(1000, 0.2, kPeriodic)), 1);
    run.advance(5, 0.05);
    ParcelSnapshot snapshot = run.backend->snapshot();
    snapshot.velocity[17].x = speed_mps;
    run.backend->restore(snapshot);
    return run.advance(40, 0.05).totals;
  };
  const StepTotals valid = fly(0.5F);
  EXPECT_EQ(valid.num_invalid, 0U);
  for (const float broken_mps :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), 1e20F}) {
    const StepTotals totals = fly(broken_mps);
    EXPECT_EQ(totals.num_invalid, 1U) << "a parcel, however many steps it is seen in";
    EXPECT_EQ(totals.first_invalid_id, 17U);
    const double collisions = static_cast<double>(valid.num_collisions);
    EXPECT_NEAR(static_cast<double>(totals.num_collisions), collisions, 0.1 * collisions);
  }
}

// ---- situations that stop other codes

// Multiplies all velocities by 4. The sequence of collisions stays the same, only faster.
void speed_up(SceneRun& run) {
  ParcelSnapshot snapshot = run.backend->snapshot();
  for (Vec2f& v : snapshot.velocity) v = v * 4.0F;
  run.backend->restore(snapshot);
}

// Inelastic collapse (McNamara and Young 1994), with 60 collisions per parcel here and ten thousand by hand
// (PF_TEST_SCALE=167). These cool the gas by 20 powers of ten, which would exceed the limit of time, so it is
// sped up on the way. In the end it streams in bands that hardly collide.
class Collapse : public testing::TestWithParam<double> {};

TEST_P(Collapse, Passes) {
  Settings s = exact(gas(1024, 0.25, kPeriodic));
  s.restitution = 0.6;
  s.contact_clock_s = GetParam();
  SceneRun run(s, 1);
  StepTotals totals;
  const std::uint64_t wanted = 512ULL * 60 * static_cast<std::uint64_t>(test_scale());
  double cooled = run.backend->measure().parcel_energy_j / 1024.0, time_s = 0.0;
  std::uint64_t steps = 0;
  int num_speed_ups = 0;
  while (totals.num_collisions < wanted) {
    double energy = run.backend->measure().parcel_energy_j / 1024.0;
    if (energy < 0x1p-4) {
      speed_up(run);
      ++num_speed_ups;
      cooled *= 0x1p4;
      energy = run.backend->measure().parcel_energy_j / 1024.0;
    }
    const double step_s = 0.1 / (collision_rate_per_s(run) * std::sqrt(energy));
    totals += run.advance(10, step_s).totals;
    steps += 10;
    time_s += 10.0 * step_s;
    ASSERT_LE(energy, cooled * (1.0 + 1e-9));
    cooled = energy;
  }
  std::printf(
      "clock %g s: %.0f collisions per parcel in %.3g s, sped up %d times, %llu steps, %.1f rounds each, "
      "%llu retried, energy %.2g of the first\n",
      GetParam(), static_cast<double>(totals.num_collisions) / 512.0, time_s, num_speed_ups,
      static_cast<unsigned long long>(totals.num_steps),
      static_cast<double>(totals.num_rounds) / static_cast<double>(totals.num_steps),
      static_cast<unsigned long long>(totals.num_retried_steps), std::ldexp(cooled, -4 * num_speed_ups));
  expect_sound(run, totals, steps);
}

INSTANTIATE_TEST_SUITE_P(Clock, Collapse, testing::Values(0.0, 0.01));

// A block of 144 parcels flies into the corner of a box. With losses and without a contact duration that
// would be a collapse; it would pass as well, at e = 0.5 with two million collisions in the time of one
// diameter.
TEST(Exact, SurvivesACrowdCrushedIntoACorner) {
  for (const double restitution : {1.0, 0.5, 0.0}) {
    Settings s = exact(gas(144, 0.4, kWalls));
    s.restitution = restitution;
    s.contact_clock_s = restitution < 1.0 ? 1e-3 : 0.0;
    SceneRun run(s, 1);
    ParcelSnapshot crowd = run.backend->snapshot();
    for (Vec2f& v : crowd.velocity) v = {1.0F + 1e-3F * v.x, 1.0F + 1e-3F * v.y};
    run.backend->restore(crowd);
    const StepTotals totals = run.advance(150, 0.1).totals;
    std::printf("e = %g: %llu collisions, %.1f rounds a step, %llu retried\n", restitution,
                static_cast<unsigned long long>(totals.num_collisions),
                static_cast<double>(totals.num_rounds) / 150.0,
                static_cast<unsigned long long>(totals.num_retried_steps));
    EXPECT_GT(totals.num_collisions, 200U);
    expect_sound(run, totals, 150);
  }
}

// One fast parcel sets the bound on all speeds; parcels that it hits pass the impulse on.
TEST(Exact, OneFastParcelAmongManyAtRest) {
  Settings s = exact(gas(100000, 0.3, kPeriodic));
  SceneRun run(s, 2);
  ParcelSnapshot still = run.backend->snapshot();
  for (Vec2f& v : still.velocity) v = {};
  still.velocity[50000] = {100.0F, 30.0F};
  run.backend->restore(still);
  const double before = run.backend->measure().parcel_energy_j;
  const StepTotals totals = run.advance(10, 0.01).totals;
  EXPECT_GT(totals.num_collisions, 10U);
  EXPECT_EQ(totals.num_invalid, 0U);
  EXPECT_NEAR(run.backend->measure().parcel_energy_j / before, 1.0, 1e-6);
}

// Rows of parcels at the contact distance, and two parcels at one position.
TEST(Exact, ParcelsThatTouchAtTheStart) {
  Settings s = exact(gas(100, 0.2, kPeriodic));
  SceneRun run(s, 1);
  ParcelSnapshot rows = run.backend->snapshot();
  const auto contact =
      static_cast<std::int32_t>(2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m);
  for (int i = 0; i < 100; ++i) rows.position[i] = {(i % 10 - 5) * contact, (i / 10 - 5) * contact};
  rows.position[99] = {kHalfSide - 5, 0};
  rows.position[98] = {kHalfSide - 5, 0};
  run.backend->restore(rows);
  const double before = run.backend->measure().parcel_energy_j;
  const StepTotals totals = run.advance(100, 0.05).totals;
  EXPECT_GT(totals.num_collisions, 100U);
  EXPECT_NEAR(run.backend->measure().parcel_energy_j / before, 1.0, 1e-6);
  expect_sound(run, totals, 100);
}

// Two parcels that rest, touching, are hit from both sides at once. All collisions happen within one tick. If
// an event could come before others that were due before its cause, the ids would break the symmetry.
TEST(Exact, CollisionsAtOneTickKeepAMirrorImage) {
  for (const double restitution : {0.0, 0.5, 0.9}) {
    Settings settings = exact(gas(4, 0.003, kPeriodic));
    settings.restitution = restitution;
    SceneRun run(settings, 1);
    ParcelSnapshot row = run.backend->snapshot();
    const auto contact =
        static_cast<std::int32_t>(2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m);
    const float velocities[] = {1.0F, 0.0F, 0.0F, -1.0F};
    for (int i = 0; i < 4; ++i) {
      row.position[i] = {i * contact, 0};
      row.velocity[i] = {velocities[i], 0.0F};
    }
    run.backend->restore(row);
    EXPECT_GT(run.advance(1, 0.1).totals.num_collisions, 4U);
    const ParcelSnapshot after = run.backend->snapshot();
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(after.velocity[i].x, -after.velocity[3 - i].x)
          << "parcel " << i << ", restitution " << restitution;
      EXPECT_LE(after.velocity[i].x, 0.0F);
    }
  }
}

TEST(Exact, RejectsACrowdThatCannotBeResolved) {
  SceneRun run = parcel_in_a_vice(make_cpu_backend(1));
  try {
    run.advance(1, 0.1);
    FAIL() << "no error";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("than can be resolved in order"), std::string::npos)
        << error.what();
  }
}

// The parcel lies between ball and wall then, and touches both: parcel and ball are of the same moment.
TEST(Exact, LeavesTheStateOfTheMomentThatCannotBeResolved) {
  SceneRun run = parcel_before_a_press(make_cpu_backend(1));
  expect_whole_state_when_unresolvable(run);
}

TEST(Exact, ZeroRestitution) {
  Settings s = exact(gas(256, 0.25, kPeriodic));
  s.restitution = 0.0;
  SceneRun run(s, 1);
  const double before = run.backend->measure().parcel_energy_j;
  const StepTotals totals = run.advance(300, 0.05).totals;
  EXPECT_GT(totals.num_collisions, 256U);
  EXPECT_LT(run.backend->measure().parcel_energy_j, 0.5 * before);
  expect_sound(run, totals, 300);
}

// A box hardly wider than two parcels: a displacement of a diameter uses up the room for search boxes.
TEST(Exact, ASmallWorld) {
  for (const Boundary boundary : {kPeriodic, kWalls}) {
    SceneRun run(exact(gas(2, 0.2, boundary)), 1);
    expect_sound(run, run.advance(2000, 0.1).totals, 2000);
  }
  Settings alone = exact(gas(100, 0.2, kWalls));
  alone.contacts = false;
  SceneRun run(alone, 1);
  EXPECT_EQ(run.advance(2000, 0.1).totals.num_collisions, 0U);
}

// ---- changes during a run

TEST(Exact, ContinuesAfterOtherMethodsAndRadii) {
  Settings s = gas(800, 0.3, kWalls);
  SceneRun run(s, 1);
  for (const double radius : {0.5, 0.55, 0.5}) {
    run.physics.parcels.radius_m = radius;
    run.backend->set_physics(run.physics);
    for (const Method method : {Method::impulse, Method::exact}) {
      run.settings.method = method;
      const Measures before = run.backend->measure();
      StepTotals totals;
      for (int k = 0; k < 20; ++k) totals += run.advance(5, 0.035).totals;
      const Measures after = run.backend->measure();
      EXPECT_EQ(after.num_live, 800U);
      EXPECT_GT(totals.num_collisions, 100U);
      EXPECT_EQ(totals.num_invalid, 0U);
      if (method == Method::impulse) continue;
      EXPECT_NEAR(after.parcel_energy_j / before.parcel_energy_j, 1.0, 1e-6);
      EXPECT_LE(largest_overlap_units(run), overlap_bound_units(run)) << "radius " << radius;
    }
    // The radius also grows while `exact` runs.
    run.physics.parcels.radius_m = radius + 0.02;
    run.backend->set_physics(run.physics);
    run.advance(20, 0.035);
    EXPECT_LE(largest_overlap_units(run), overlap_bound_units(run)) << "radius " << radius << " + 0.02";
  }
}

}  // namespace
}  // namespace pf::test
