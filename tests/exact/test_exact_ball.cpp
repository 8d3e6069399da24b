// The ball in method `exact`: conservation with heavy and light balls, equipartition, spin.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "exact/exact_support.hpp"

namespace pf::test {
namespace {

// Parcels are 2.6e6 times as light as the ball, which is hit several times a step and so is a participant. In
// each event energy and momentum may be off by the rounding of a parcel's velocity to float, 6e-8.
TEST(Ball, HeavyAmongLightParcelsConservesEnergyAndMomentum) {
  Settings s = exact(gas(2000, 0.2, kPeriodic));
  add_resting_ball(s, 2.6e6, 6.0);
  s.ball_vx_mps = 0.5;
  s.friction = 0.0;
  SceneRun run(s, 1);
  const Measures before = run.backend->measure();
  const StepTotals totals = run.advance(100, 0.4).totals;
  const Measures after = run.backend->measure();
  EXPECT_GT(totals.num_ball_hits, 200U);
  const double events = static_cast<double>(totals.num_collisions + totals.num_ball_hits);
  EXPECT_NEAR(after.energy_j(), before.energy_j(), energy_bound_j(events));
  const double light_kg_mps = before.momentum_scale_kg_mps - s.ball_mass_kg * s.ball_vx_mps;
  EXPECT_LT(length(after.momentum_kg_mps - before.momentum_kg_mps) / light_kg_mps,
            6e-8 * std::sqrt(2.0 * events) / std::sqrt(2000.0) + 1e-12 * s.ball_mass_kg / light_kg_mps);
}

// A ball of a third of a parcel's mass recoils from it. Without the recoil energy would double.
TEST(Ball, LighterThanAParcelConservesEnergy) {
  Settings s = court(2, Boundary::periodic);
  s.area_fraction = 0.01;
  s.method = Method::exact;
  s.restitution = 1.0;
  s.friction = 0.0;
  s.magnus = false;
  SceneRun run(s);
  const double before = run.backend->measure().energy_j();
  const StepReport report = run.advance(2000, 1e-3);
  EXPECT_GT(report.totals.num_ball_hits, 0U);
  EXPECT_NEAR(run.backend->measure().energy_j(), before, 1e-6 * before);  // velocities are stored as floats
}

Settings ball_in_gas(std::int64_t n, double eta, double mass_kg, double radius_m) {
  Settings s = exact(gas(n, eta, kPeriodic));
  s.ball_present = true;
  s.ball_mass_kg = mass_kg;
  s.ball_radius_m = radius_m;
  s.ball_x_m = s.ball_y_m = s.ball_vx_mps = s.ball_spin_radps = 0.0;
  s.friction = 0.0;
  s.magnus = false;
  return s;
}

// A smooth ball of 20 parcel masses has energy kT (1 - m_b / M) in equilibrium; M is the mass of all, total
// momentum is zero. The error follows from the scatter over blocks that are long against the ball's
// relaxation.
TEST(Ball, HoldsItsShareOfTheEnergy) {
  const double num = 80.0, mass = 20.0;
  SceneRun run(ball_in_gas(80, 0.2, mass, 1.5), 1);
  run.advance(500, 0.1);
  const int blocks = 100 * test_scale();
  double sum = 0.0, sum2 = 0.0;
  for (int block = 0; block < blocks; ++block) {
    double energy = 0.0;
    for (int k = 0; k < 400; ++k) {
      const Vec2d v = run.advance(5, 0.1).ball.velocity_mps;
      energy += 0.5 * mass * dot(v, v) / 400.0;
    }
    sum += energy;
    sum2 += energy * energy;
  }
  const double mean = sum / blocks;
  const double error = std::sqrt((sum2 / blocks - mean * mean) / (blocks - 1));
  // 2 (N + 1) degrees of freedom, less two of the momentum, share the energy.
  const double kT = run.backend->measure().energy_j() / num;
  const double expected = kT * (1.0 - mass / (mass + num));
  std::printf("ball's energy over its share: %.4f +- %.4f\n", mean / expected, error / expected);
  EXPECT_NEAR(mean, expected, 4.0 * error);
  EXPECT_LT(error / expected, 0.05);
}

// Without friction spin has no effect: no torque, and the same events and impulses to the last bit.
TEST(Ball, SpinOfASmoothBallHasNoEffect) {
  const auto totals_with = [](double spin_radps) {
    Settings s = ball_in_gas(500, 0.1, 1e3, 3.0);
    s.ball_vx_mps = 2.0;
    s.ball_spin_radps = spin_radps;
    SceneRun run(s, 1);
    // Ticks otherwise follow from the fastest point of the ball.
    run.physics.reference_speed_mps = 32.0;
    const Spawner spawner(run.settings, run.physics, run.ball);
    run.backend->reset(run.physics, spawner.plan(), run.ball);
    return run.advance(500, 0.05).totals;
  };
  const StepTotals still = totals_with(0.0), spinning = totals_with(7.0);
  EXPECT_GT(still.num_ball_hits, 20U);
  EXPECT_EQ(spinning.ball_torque_impulse_kg_m2ps, 0.0);
  EXPECT_EQ(spinning.event_hash, still.event_hash);
  EXPECT_EQ(spinning.ball_impulse_kg_mps, still.ball_impulse_kg_mps);
}

// A ball that passes a thin periodic world many times in a step of the longer ones.
TEST(Ball, IsHitAsOftenInStepsInWhichItPassesTheWorld) {
  Settings s = exact(gas(200, 0.01, kPeriodic));
  s.box_follows_parcels = false;
  s.width_m = 200.0;
  s.height_m = 30.0;
  add_resting_ball(s, 1e4, 3.0);
  s.ball_vy_mps = 40.0;
  const auto fly = [&](double dt_s) {
    SceneRun run(s, 1);
    StepTotals totals;
    const int num = static_cast<int>(std::lround(12.0 / dt_s));
    StepReport report;
    for (int k = 0; k < num; ++k) {
      report = run.advance(1, dt_s);
      totals += report.totals;
    }
    EXPECT_LE(std::abs(report.ball.position_m.y), 15.0);
    return std::pair(totals.num_ball_hits, report.ball.position_m.y);
  };
  const auto [hits, y_m] = fly(0.1);
  EXPECT_GT(hits, 20U);
  for (const double dt_s : {2.0, 6.0}) {
    const auto [hits_of_long, y_of_long] = fly(dt_s);
    EXPECT_EQ(hits_of_long, hits) << dt_s;
    EXPECT_NEAR(y_of_long, y_m, 1e-3) << dt_s;
  }
}

// Held in flight, and let go again: as if it had been put there.
TEST(Ball, HeldInFlightStays) {
  Settings s = exact(gas(500, 0.1, kPeriodic));
  add_resting_ball(s, 100.0, 2.0);
  s.ball_vx_mps = 5.0;
  const auto fly = [&](bool puts) {
    SceneRun run(s, 1);
    StepReport report = run.advance(20, 0.05);
    for (const bool held : {true, false}) {
      const BallState before = report.ball;
      run.physics.ball.held = held;
      run.backend->set_physics(run.physics);
      if (puts) run.backend->set_ball(report.ball);
      report = run.advance(20, 0.05);
      if (held) {
        EXPECT_EQ(report.ball.position_m, before.position_m);
      }
    }
    return run.backend->state_hash();
  };
  EXPECT_EQ(fly(false), fly(true));
}

}  // namespace
}  // namespace pf::test
