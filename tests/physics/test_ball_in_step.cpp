// The ball within a step: it hits all parcels along the chord of its arc, and flies as it does alone if it
// hits none.
#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_support.hpp"

namespace pf::test {
namespace {

// A heavy ball of radius 0.2 m at the origin, and parcels of radius 0.05 m.
Settings ball_among(std::int64_t num_parcels, Method method) {
  Settings s = court(num_parcels, Boundary::periodic);
  s.width_m = s.height_m = 8.0;
  s.method = method;
  s.parcel_radius_m = 0.05;
  s.parcel_mass_kg = 1e-6;
  s.ball_mass_kg = 1.0;
  s.ball_radius_m = 0.2;
  s.ball_x_m = s.ball_y_m = s.ball_spin_radps = s.friction = 0.0;
  s.ball_vx_mps = 1.0;
  s.contacts = false;
  s.dt_s = 0.01;
  return s;
}

// Flies among parcels at rest.
StepReport fly_among(SceneRun& run, const std::vector<Vec2d>& positions_m, std::uint32_t num_steps,
                     double dt_s) {
  ParcelSnapshot state;
  for (const Vec2d& position_m : positions_m) {
    state.position.push_back(to_units(run.physics.world, position_m));
    state.velocity.push_back({0.0F, 0.0F});
  }
  run.backend->restore(state);
  return run.advance(num_steps, dt_s);
}

class BallInStep : public testing::TestWithParam<Method> {};

// The ball flies 2 m in one step, eight contact distances. It hits the near parcel and the far one in its
// path, not those beside it and behind it.
TEST_P(BallInStep, HitsEveryParcelInItsPath) {
  SceneRun run(ball_among(4, GetParam()), 1);
  const StepReport report = fly_among(run, {{0.4, 0.1}, {1.9, -0.2}, {1.0, 0.26}, {-0.3, 0.0}}, 1, 2.0);
  EXPECT_EQ(report.totals.num_ball_hits, 2U);
  const std::vector<Vec2f> v = run.backend->snapshot().velocity;
  EXPECT_GT(v[0].x, 0.0F);
  EXPECT_GT(v[1].x, 0.0F);
  EXPECT_EQ(v[2], (Vec2f{}));
  EXPECT_EQ(v[3], (Vec2f{}));
}

// A parcel 0.75 m from the centre of a held ball, 0.5 m from its surface, comes in at 3.75 m/s and leaves at
// half of that. After 4/15 s it is 0.25 m from the surface, whatever the steps, and whatever velocity the
// ball has, since it is held. Velocities are rounded to float (1.2e-7 m/s for 0.13 s: 2e-8 m), positions to
// units of 4e-9 m in each step, ticks to 1e-9 s.
TEST_P(BallInStep, AParcelMovesUpToTheBallAndBackWithinTheStep) {
  for (const auto& [num_steps, velocity_mps] :
       {std::pair(1U, 0.0), std::pair(2U, 2.0), std::pair(5U, -2.0)}) {
    Settings s = ball_among(2, GetParam());
    s.ball_held = true;
    s.ball_vx_mps = velocity_mps;
    s.restitution = 0.5;
    SceneRun run(s, 1);
    const World& world = run.physics.world;
    run.backend->restore(
        {{to_units(world, {0.45, 0.6}), to_units(world, {-3.0, -3.0})}, {{-2.25F, -3.0F}, {}}});
    run.advance(num_steps, 4.0 / 15.0 / num_steps);
    const Vec2d at = to_metres(world, run.backend->snapshot().position[0]);
    EXPECT_NEAR(at.x, 0.3, 5e-8) << num_steps;
    EXPECT_NEAR(at.y, 0.4, 5e-8) << num_steps;
  }
}

// A parcel hits a ball at rest off its centre, at n = (0.8, 0.6). Velocity and spin of the ball follow from
// the parcel's loss: M V = -m dv, I w = -R n x m dv. This holds both for hits that are events and for hits of
// light parcels, which are applied at the step's end. The parcel's velocity is rounded to float, 1e-7 of 3
// m/s.
TEST_P(BallInStep, TheBallTakesMomentumAndSpinFromAHit) {
  for (const double mass_kg : {1e-9, 1e-3}) {
    Settings s = ball_among(2, GetParam());
    s.ball_vx_mps = 0.0;
    s.magnus = false;
    s.friction = 0.3;
    s.parcel_mass_kg = mass_kg;
    SceneRun run(s, 1);
    const World& world = run.physics.world;
    const Vec2f before{-3.0F, 0.0F};
    run.backend->restore({{to_units(world, {0.6, 0.15}), to_units(world, {-3.0, -3.0})}, {before, {}}});
    const BallState ball = run.advance(4, 0.1).ball;
    const Vec2d lost = to_double(before) - to_double(run.backend->snapshot().velocity[0]);
    const double spin_radps =
        s.ball_radius_m * mass_kg * cross(Vec2d{0.8, 0.6}, lost) / run.physics.ball.inertia_kg_m2;
    EXPECT_NEAR(ball.velocity_mps.x, mass_kg * lost.x, 1e-6 * mass_kg);
    EXPECT_NEAR(ball.velocity_mps.y, mass_kg * lost.y, 1e-6 * mass_kg);
    EXPECT_GT(ball.spin_radps, 0.0);
    EXPECT_NEAR(ball.spin_radps / spin_radps, 1.0, 1e-5);
  }
}

// The ball turns by 1 rad in a step and flies from the origin to (sin 1, 1 - cos 1) m = (0.84, 0.46) m. One
// parcel lies on the chord, out of reach of the tangent (0.41 m); another on the tangent, out of reach of the
// chord (0.34 m).
TEST(BallOnItsArc, HitsParcelsOnTheChordOfItsArc) {
  Settings s = ball_among(2, Method::impulse);
  s.ball_spin_radps = 1.0;
  s.k_magnus = 1.0;
  SceneRun run(s, 1);
  const StepReport report = fly_among(run, {{0.757, 0.414}, {0.9, 0.0}}, 1, 1.0);
  EXPECT_EQ(report.totals.num_ball_hits, 1U);
  const std::vector<Vec2f> v = run.backend->snapshot().velocity;
  EXPECT_NE(v[0], (Vec2f{}));
  EXPECT_EQ(v[1], (Vec2f{}));
}

// The ball flies on a circle of 1 m about (0, 1) m. Position, velocity and angle follow from the time. Method
// exact does not round the ball's trajectory; ticks round the time by 5e-10 s at most.
TEST_P(BallInStep, CurvesAsItDoesAlone) {
  for (const double spin : {1.0, -2.0}) {
    Settings s = ball_among(2, GetParam());
    s.ball_spin_radps = spin;
    s.k_magnus = 1.0;
    SceneRun run(s, 1);
    const BallState ball = fly_among(run, {{-3.0, -3.0}, {-3.0, 3.0}}, 30, 0.05).ball;
    const double t = 1.5;
    EXPECT_NEAR(ball.position_m.x, std::sin(spin * t) / spin, 1e-9);
    EXPECT_NEAR(ball.position_m.y, (1.0 - std::cos(spin * t)) / spin, 1e-9);
    EXPECT_NEAR(ball.velocity_mps.x, std::cos(spin * t), 1e-9);
    EXPECT_NEAR(ball.velocity_mps.y, std::sin(spin * t), 1e-9);
    EXPECT_EQ(ball.spin_radps, spin);
    EXPECT_NEAR(ball.angle_rad, spin * t, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, BallInStep, testing::Values(Method::impulse, Method::exact));

}  // namespace
}  // namespace pf::test
