// Many parcels against the statistics of hard discs.
#include <gtest/gtest.h>

#include <cmath>

#include "model/kinetic_theory.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

double mean_square_speed_per_component(SceneRun& run) {
  const Measures m = run.backend->measure();
  return m.parcel_energy_j / (run.physics.parcels.num * run.physics.parcels.mass_kg);
}

// 30,000 parcels x 15 time units x 1.29 collisions have a statistical error of 0.19 %. The 2 % are for the
// method's missed collisions and for the walls (+0.4 %).
TEST(Gas, CollisionRateAgreesWithEnskog) {
  SceneRun run(gas(30000));
  run.advance(500, 0.01);
  const double c2_before = mean_square_speed_per_component(run);
  const StepReport report = run.advance(1500, 0.01);
  const double c = std::sqrt(0.5 * (c2_before + mean_square_speed_per_component(run)));
  const double rate = 2.0 * static_cast<double>(report.totals.num_collisions) / (30000 * 15.0);
  EXPECT_NEAR(rate / enskog_rate_per_s(0.2, c, 0.5), 1.0, 0.02);
}

// Mean square per component c^2, fourth moment 8 c^4, both within 4 sigma.
TEST(Gas, StartsMaxwellian) {
  SceneRun run(gas(100000));
  const ParcelSnapshot s = run.backend->snapshot();
  double v2 = 0.0, v4 = 0.0;
  for (const Vec2f& v : s.velocity) {
    const double square = static_cast<double>(dot(v, v));
    v2 += square;
    v4 += square * square;
  }
  const double n = static_cast<double>(s.velocity.size());
  EXPECT_NEAR(v2 / n, 2.0, 4.0 * 2.0 / std::sqrt(n / 2));
  EXPECT_NEAR(v4 / n, 8.0, 4.0 * std::sqrt((384.0 - 64.0) / (n / 2)));
  EXPECT_NEAR(run.backend->measure().momentum_kg_mps.x, 0.0, 1e-9 * n);
}

// Momentum of parcels and ball together in a periodic world. The parcels' velocities are floats: rounding
// errors of 2^-25 |v| per step add up as a random walk over parcels and steps.
TEST(Gas, MomentumIsConservedWithTheBall) {
  Settings s = court(20000, Boundary::periodic);
  s.ball_x_m = 0.0;
  s.ball_vx_mps = 10.0;
  s.ball_mass_kg = 1e-3;
  s.areal_density_kg_m2 = 1e-2;
  s.magnus = false;
  SceneRun run(s);
  const Measures before = run.backend->measure();
  const StepReport report = run.advance(400, 5e-4);
  const Measures after = run.backend->measure();
  EXPECT_GT(report.totals.num_ball_hits, 20U);
  EXPECT_GT(report.totals.num_collisions, 100U);
  const double parcel_momentum = run.physics.parcels.mass_kg * 3.0;  // of a fast parcel
  const double bound = 6.0 * parcel_momentum * 0x1p-25 * std::sqrt(20000.0 * 400.0);
  EXPECT_NEAR(after.momentum_kg_mps.x, before.momentum_kg_mps.x, bound);
  EXPECT_NEAR(after.momentum_kg_mps.y, before.momentum_kg_mps.y, bound);
}

TEST(Gas, OpenWorldRetiresAndCountsLeavingParcels) {
  Settings s = court(2000);
  s.ball_present = false;
  s.contacts = false;
  SceneRun run(s);
  const StepReport report = run.advance(2000, 0.01);
  const Measures m = run.backend->measure();
  EXPECT_GT(report.totals.num_retired, 1900U) << "after 20 s at 1 m/s almost all have left";
  EXPECT_EQ(m.num_live + report.totals.num_retired, 2000U);
}

TEST(Gas, WallsKeepEveryParcelInside) {
  SceneRun run(gas(3000, 0.3));
  run.advance(1000, 0.02);
  const Vec2i half = run.physics.world.half;
  for (const Vec2i& p : run.backend->snapshot().position) {
    EXPECT_LE(std::abs(p.x), half.x);
    EXPECT_LE(std::abs(p.y), half.y);
  }
  EXPECT_EQ(run.backend->measure().num_live, 3000U);
}

// A parcel that flies freely for many steps arrives at v t: the random rounding has no bias.
TEST(Gas, RoundingOfPositionsHasNoBias) {
  Settings s = court(4000, Boundary::periodic);
  s.contacts = false;
  s.ball_present = false;
  SceneRun run(s);
  const ParcelSnapshot before = run.backend->snapshot();
  const int steps = 4000;
  const double dt = 1e-5;
  run.advance(steps, dt);
  const ParcelSnapshot after = run.backend->snapshot();
  double bias = 0.0;
  for (std::size_t i = 0; i < before.position.size(); ++i) {
    const double expected = before.velocity[i].x * (steps * dt) / run.physics.world.unit_m;
    bias += axis_separation<Boundary::periodic>(before.position[i].x, after.position[i].x,
                                                run.physics.world.half.x) -
            expected;
  }
  bias /= static_cast<double>(before.position.size()) * steps;  // units per step
  // One rounding scatters by at most half a unit, so that the mean of all scatters by 0.5 / sqrt(1.6e7).
  EXPECT_NEAR(bias, 0.0, 5.0 * 0.5 / std::sqrt(4000.0 * steps));
}

}  // namespace
}  // namespace pf::test
