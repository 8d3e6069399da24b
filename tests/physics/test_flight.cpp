// The flight of the ball alone: Magnus circle, closed-form drag.
#include <gtest/gtest.h>

#include <cmath>

#include "model/ball.hpp"

namespace pf {
namespace {

BallConstants spinning_ball() {
  BallConstants ball;
  ball.inertia_kg_m2 = 1e-3;
  ball.magnus_per_rad = 0.02;
  return ball;
}

TEST(Flight, MagnusCircleClosesAfterAThousandTurns) {
  const BallConstants ball = spinning_ball();
  const World world = make_world(1000.0, 1000.0, Boundary::open);
  BallState state{{3.0, -2.0}, {5.0, 1.0}, 25.0, 0.0};
  const BallState start = state;
  const int steps_per_turn = 64;
  const double turn_rate = ball.magnus_per_rad * state.spin_radps;
  const double dt = 2.0 * kPi / turn_rate / steps_per_turn;
  for (int k = 0; k < 1000 * steps_per_turn; ++k)
    advance_ball(world, ball, fly(ball, state, dt), {}, 1.0, state);
  EXPECT_NEAR(state.position_m.x, start.position_m.x, 1e-9);
  EXPECT_NEAR(state.position_m.y, start.position_m.y, 1e-9);
  EXPECT_NEAR(state.velocity_mps.x, start.velocity_mps.x, 1e-9);
  EXPECT_NEAR(state.velocity_mps.y, start.velocity_mps.y, 1e-9);
}

TEST(Flight, MagnusOrbitHasTheRadiusOfTheory) {
  const BallConstants ball = spinning_ball();
  const World world = make_world(1000.0, 1000.0, Boundary::open);
  BallState state{{0.0, 0.0}, {5.0, 0.0}, 25.0, 0.0};
  const double radius = 5.0 / (ball.magnus_per_rad * 25.0);  // v / Omega, centre to the left of the velocity
  for (int k = 0; k < 500; ++k) {
    advance_ball(world, ball, fly(ball, state, 0.03), {}, 1.0, state);
    EXPECT_NEAR(std::hypot(state.position_m.x, state.position_m.y - radius), radius, 1e-12 * 500);
  }
}

// dv/dt = -k v^2 without spin: v(x) = v0 exp(-k x) and x = ln(1 + k v0 t) / k.
TEST(Flight, DragFollowsTheClosedForm) {
  BallConstants ball = spinning_ball();
  ball.magnus_per_rad = 0.0;
  ball.drag_per_m = 0.033;
  const World world = make_world(1000.0, 1000.0, Boundary::open);
  BallState state{{0.0, 0.0}, {20.0, 0.0}, 0.0, 0.0};
  for (int k = 0; k < 100; ++k) {
    advance_ball(world, ball, fly(ball, state, 0.01), {}, 1.0, state);
    const double t = 0.01 * (k + 1);
    EXPECT_NEAR(state.position_m.x, std::log1p(0.033 * 20.0 * t) / 0.033, 1e-10);
    EXPECT_NEAR(state.velocity_mps.x, 20.0 * std::exp(-0.033 * state.position_m.x), 1e-10);
  }
}

TEST(Flight, SmallTurnsJoinTheSeriesSmoothly) {
  BallConstants ball = spinning_ball();
  const BallState state{{0, 0}, {10.0, 0.0}, 1.0, 0.0};
  ball.magnus_per_rad = 0.99e-4;
  const BallFlight series = fly(ball, state, 1.0);
  ball.magnus_per_rad = 1.01e-4;
  const BallFlight closed = fly(ball, state, 1.0);
  EXPECT_NEAR(closed.displacement_m.y - series.displacement_m.y, 10.0 * 0.5 * 2e-6, 1e-11);
  EXPECT_NEAR(closed.displacement_m.x, series.displacement_m.x, 1e-8);
}

// The chord of an arc of angle theta is (sin theta) / theta along v and (1 - cos theta) / theta across v.
// Here theta is small enough for the series; rounding is 2e-15 of 10 m.
TEST(Flight, SmallTurnsFollowTheChordOfTheArc) {
  BallConstants ball = spinning_ball();
  const BallState state{{0, 0}, {10.0, 0.0}, 1.0, 0.0};
  for (const double theta : {0.9e-4, -0.9e-4, 1e-6}) {
    ball.magnus_per_rad = theta;
    const BallFlight flight = fly(ball, state, 1.0);
    EXPECT_NEAR(flight.displacement_m.x, 10.0 * std::sin(theta) / theta, 2e-14);
    EXPECT_NEAR(flight.displacement_m.y, 20.0 * std::sin(0.5 * theta) * std::sin(0.5 * theta) / theta, 2e-14);
  }
}

TEST(Flight, BallTurnsAtItsSpin) {
  const World world = make_world(1000.0, 1000.0, Boundary::open);
  BallState state{{0.0, 0.0}, {5.0, 0.0}, 25.0, 0.5};
  for (int k = 0; k < 10; ++k)
    advance_ball(world, spinning_ball(), fly(spinning_ball(), state, 0.03), {}, 1.0, state);
  EXPECT_NEAR(state.angle_rad, 0.5 + 10 * 0.03 * 25.0, 1e-13);
}

// With both drag and turn the displacement has no closed form. One step is compared with a hundred short
// ones. Five points of Gauss and Legendre are exact up to t^9; speed and heading change by a tenth, which
// leaves 1e-10 of the displacement, 10 m.
TEST(Flight, OneLongStepAgreesWithManyShortOnes) {
  BallConstants ball = spinning_ball();
  ball.drag_per_m = 0.01;
  const World world = make_world(1000.0, 1000.0, Boundary::open);
  const BallState start{{1.0, 2.0}, {8.0, -6.0}, 5.0, 0.0};
  BallState one_step = start, many_steps = start;
  advance_ball(world, ball, fly(ball, one_step, 1.0), {}, 1.0, one_step);
  for (int k = 0; k < 100; ++k) advance_ball(world, ball, fly(ball, many_steps, 0.01), {}, 1.0, many_steps);
  EXPECT_NEAR(one_step.position_m.x, many_steps.position_m.x, 1e-9);
  EXPECT_NEAR(one_step.position_m.y, many_steps.position_m.y, 1e-9);
  EXPECT_NEAR(one_step.velocity_mps.x, many_steps.velocity_mps.x, 1e-12);
}

}  // namespace
}  // namespace pf
