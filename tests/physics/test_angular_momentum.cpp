// Angular momentum of ball and parcels in an open world, per hit and in total, with friction.
//
// Impulse and counter-impulse act at the point of contact, on the ball's rim. A parcel is a disc without
// spin: it keeps only its centre's share of the friction J_t. Each hit therefore loses exactly r J_t, with
// the parcel's radius r.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

constexpr double kSpeed = 3.0;  // of the parcels
constexpr double kWorldSide = 16.0;

Settings lone_ball(std::int64_t n, double friction) {
  Settings s;
  s.width_m = s.height_m = kWorldSide;
  s.num_parcels = n;
  s.parcel_radius_m = 0.02;
  s.parcel_mass_kg = 1e-3;
  s.parcel_speed_mps = kSpeed;  // the scale of the fixed-point sums
  s.restitution = 0.9;
  s.contacts = false;
  s.ball_mass_kg = 1.0;
  s.ball_radius_m = 0.5;
  s.ball_x_m = 1.0;
  s.ball_y_m = -0.5;
  s.ball_vx_mps = 0.0;
  s.ball_spin_radps = 2.0;
  s.friction = friction;
  s.magnus = false;
  return s;
}

// Parcels that fly towards the ball from all sides, at impact parameters up to its radius.
ParcelSnapshot incoming(const SceneRun& run) {
  ParcelSnapshot state;
  for (std::uint32_t i = 0; i < run.physics.parcels.num; ++i) {
    const double angle = 2.0 * kPi * uniform(random_bits(5, i, 0));
    const Vec2d direction{std::cos(angle), std::sin(angle)};
    const double off_m = run.physics.ball.radius_m * (2.0 * uniform(random_bits(5, i, 1)) - 1.0);
    const double away_m = 0.6 + 1.5 * uniform(random_bits(5, i, 2));
    state.position.push_back(to_units(
        run.physics.world, run.ball.position_m - direction * away_m + perpendicular(direction) * off_m));
    state.velocity.push_back(to_float(direction * kSpeed));
  }
  return state;
}

double angular_momentum(SceneRun& run, const BallState& ball) {
  double sum = run.physics.ball.mass_kg * cross(ball.position_m, ball.velocity_mps) +
               run.physics.ball.inertia_kg_m2 * ball.spin_radps;
  const ParcelSnapshot s = run.backend->snapshot();
  for (std::size_t i = 0; i < s.position.size(); ++i) {
    sum += run.physics.parcels.mass_kg *
           cross(to_metres(run.physics.world, s.position[i]), to_double(s.velocity[i]));
  }
  return sum;
}

// Bound on the rounding for one parcel: its position by a unit per step and axis, times its momentum; its
// velocity once to float, times its distance from the origin; the ball's sums to half a unit of 2^-32 of the
// reference speed (4 m/s), times that distance.
double rounding_bound(const SceneRun& run, int num_steps) {
  const double mass = run.physics.parcels.mass_kg;
  const double position = 2.0 * num_steps * run.physics.world.unit_m * 2.0 * kSpeed;
  const double velocity = kWorldSide * (2.0 * kSpeed * 0x1p-24 + 4.0 * 0x1p-33);
  return mass * (position + velocity);
}

class AngularMomentum : public testing::TestWithParam<double> {};  // friction

TEST_P(AngularMomentum, IsKeptInEveryHit) {
  const Settings s = lone_ball(1, GetParam());
  for (std::int64_t k = 0; k < 200; ++k) {
    SceneRun run(s, 1);
    ParcelSnapshot state = incoming(run);
    const Vec2d direction{std::cos(0.1 * k),
                          std::sin(0.1 * k)};  // a new direction and impact parameter each time
    const double off_m = 0.5 * std::sin(1.7 * k);
    state.position[0] =
        to_units(run.physics.world, run.ball.position_m - direction * 0.9 + perpendicular(direction) * off_m);
    state.velocity[0] = to_float(direction * kSpeed);
    run.backend->restore(state);
    const double before = angular_momentum(run, run.ball);
    const StepReport report = run.advance(40, 0.01);
    ASSERT_EQ(report.totals.num_ball_hits, 1U);
    const double torque = report.totals.ball_torque_impulse_kg_m2ps;
    const double lost = -torque * run.physics.parcels.radius_m / run.physics.ball.radius_m;
    EXPECT_NEAR(angular_momentum(run, report.ball) - before, lost, rounding_bound(run, 40));
    EXPECT_EQ(torque != 0.0, GetParam() > 0.0);
  }
}

// 2,000 parcels set a ball in motion. The ball takes a step's impulses at the end of the step, up to dt late,
// and has moved by V dt until then. Each hit may add |V| dt |J| of either sign to its rounding. The test
// allows four times the random walk of these.
TEST_P(AngularMomentum, IsKeptInTotal) {
  SceneRun run(lone_ball(2000, GetParam()));
  run.backend->restore(incoming(run));
  const double before = angular_momentum(run, run.ball);
  const int steps = 1000;
  const double dt = 1e-3;
  StepTotals totals;
  BallState ball;
  double fastest_mps = 0.0;
  for (int k = 0; k < steps; ++k) {
    const StepReport report = run.advance(1, dt);
    totals += report.totals;
    ball = report.ball;
    fastest_mps = std::max(fastest_mps, length(ball.velocity_mps));
  }
  EXPECT_GT(totals.num_ball_hits, 1900U);
  EXPECT_EQ(totals.num_retired, 0U);
  const double late = fastest_mps * dt * 2.0 * kSpeed * run.physics.parcels.mass_kg;
  const double hits = static_cast<double>(totals.num_ball_hits);
  const double bound = 4.0 * std::sqrt(hits) * late + hits * rounding_bound(run, steps);
  const double lost =
      -totals.ball_torque_impulse_kg_m2ps * run.physics.parcels.radius_m / run.physics.ball.radius_m;
  const double change = angular_momentum(run, ball) - before;
  EXPECT_NEAR(change, lost, bound);
  // The bound is sharp enough: friction takes more than that from the ball's spin.
  EXPECT_EQ(std::fabs(totals.ball_torque_impulse_kg_m2ps) > 10.0 * bound, GetParam() > 0.0);
  RecordProperty("change", std::to_string(change - lost));
  RecordProperty("bound", std::to_string(bound));
  RecordProperty("torque", std::to_string(totals.ball_torque_impulse_kg_m2ps));
}

INSTANTIATE_TEST_SUITE_P(Friction, AngularMomentum, testing::Values(0.0, 0.1, 0.5, 100.0));

}  // namespace
}  // namespace pf::test
