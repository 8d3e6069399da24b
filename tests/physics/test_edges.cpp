// The edge of the world: reflection at walls, entry on the other side, and exit, with exact positions.
#include <gtest/gtest.h>

#include <cmath>

#include "model/exact/trajectory.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

constexpr double kEdgesSide = 10.0;
constexpr double kRadius = 0.5;

BallState flown_ball(Boundary boundary, Vec2d position_m, Vec2d velocity_mps, double dt_s) {
  BallConstants ball;
  ball.radius_m = kRadius;
  ball.inertia_kg_m2 = 1e-3;
  BallState state{position_m, velocity_mps, 0.0, 0.0};
  advance_ball(make_world(kEdgesSide, kEdgesSide, boundary), ball, fly(ball, state, dt_s), {}, 1.0, state);
  return state;
}

// The rim touches the wall at 4.5 m; without the wall the centre would reach 4.7 m. Rounding: a few 1e-16 of
// 5 m.
TEST(Walls, ReflectTheBallByItsOvershoot) {
  for (const double side : {1.0, -1.0}) {
    const BallState x = flown_ball(Boundary::walls, {side * 4.2, 1.0}, {side * 5.0, 1.0}, 0.1);
    EXPECT_NEAR(x.position_m.x, side * 4.3, 1e-14);
    EXPECT_NEAR(x.position_m.y, 1.1, 1e-14);
    EXPECT_EQ(x.velocity_mps, (Vec2d{side * -5.0, 1.0}));
    const BallState y = flown_ball(Boundary::walls, {1.0, side * 4.2}, {1.0, side * 5.0}, 0.1);
    EXPECT_NEAR(y.position_m.y, side * 4.3, 1e-14);
    EXPECT_EQ(y.velocity_mps, (Vec2d{1.0, side * -5.0}));
  }
}

// A ball flies as far as without walls, and returns after a whole number of round trips (9 m each way). Each
// step rounds to 1e-15 m.
TEST(Walls, ReflectedBallReturnsToItsStart) {
  BallConstants ball;
  ball.radius_m = kRadius;
  ball.inertia_kg_m2 = 1e-3;
  const World world = make_world(kEdgesSide, kEdgesSide, Boundary::walls);
  BallState state{{1.0, -2.0}, {3.0, 4.5}, 0.0, 0.0};
  for (int k = 0; k < 1000; ++k) advance_ball(world, ball, fly(ball, state, 0.012), {}, 1.0, state);
  EXPECT_NEAR(state.position_m.x, 1.0, 1e-11);
  EXPECT_NEAR(state.position_m.y, -2.0, 1e-11);
  EXPECT_EQ(state.velocity_mps, (Vec2d{3.0, 4.5}));
}

// A strong hit may leave a ball beyond a wall and already on its way back.
TEST(Walls, ReturningBallKeepsItsVelocity) {
  for (const double side : {1.0, -1.0}) {
    const BallState ball = flown_ball(Boundary::walls, {side * 4.7, 0.0}, {side * -1.0, 0.0}, 0.1);
    EXPECT_NEAR(ball.position_m.x, side * 4.4, 1e-14);
    EXPECT_EQ(ball.velocity_mps.x, side * -1.0);
  }
}

// 9 m from wall to wall: 31 m are three widths and 4 m more, 40 m are four and 4 m more.
TEST(Walls, ReflectABallThatCrossesTheWorldInAStep) {
  for (const double side : {1.0, -1.0}) {
    const BallState odd = flown_ball(Boundary::walls, {side * -4.5, 0.0}, {side * 310.0, 0.0}, 0.1);
    EXPECT_NEAR(odd.position_m.x, side * 0.5, 1e-13);
    EXPECT_EQ(odd.velocity_mps.x, side * -310.0);
    const BallState even = flown_ball(Boundary::walls, {side * -4.5, 0.0}, {side * 400.0, 0.0}, 0.1);
    EXPECT_NEAR(even.position_m.x, side * -0.5, 1e-13);
    EXPECT_EQ(even.velocity_mps.x, side * 400.0);
  }
}

TEST(PeriodicEdge, BallMayPassTheWorldOftenInAStep) {
  for (const double side : {1.0, -1.0}) {
    const BallState ball = flown_ball(Boundary::periodic, {side * 1.0, 0.0}, {side * 320.0, 0.0}, 0.1);
    EXPECT_NEAR(ball.position_m.x, side * 3.0, 1e-13);
    EXPECT_EQ(ball.velocity_mps.x, side * 320.0);
  }
}

TEST(PeriodicEdge, BallEntersByItsOvershoot) {
  for (const double side : {1.0, -1.0}) {
    const BallState ball = flown_ball(Boundary::periodic, {side * 4.8, 1.0}, {side * 5.0, 0.0}, 0.1);
    EXPECT_NEAR(ball.position_m.x, side * -4.7, 1e-14);
    EXPECT_EQ(ball.velocity_mps.x, side * 5.0);
  }
}

// Flies a parcel of radius 0.5 m from x_m along a diagonal for 0.1 s. A displacement may be rounded by a
// unit.
ParcelSnapshot flown_parcel(Method method, Boundary boundary, double x_m, float vx_mps) {
  Settings s = gas(1, 0.01, boundary);
  s.box_follows_parcels = false;
  s.width_m = s.height_m = kEdgesSide;
  s.method = method;
  SceneRun run(s, 1);
  ParcelSnapshot parcel = run.backend->snapshot();
  parcel.position[0] = to_units(run.physics.world, {x_m, 0.0});
  parcel.velocity[0] = {vx_mps, 1.0F};
  run.backend->restore(parcel);
  run.advance(1, 0.1);
  return run.backend->snapshot();
}

constexpr double kUnit = kEdgesSide / 2147483648.0;

class ParcelAtEdge : public testing::TestWithParam<Method> {};

TEST_P(ParcelAtEdge, WallReflectsTheRimByTheOvershoot) {
  for (const float side : {1.0F, -1.0F}) {
    const ParcelSnapshot after = flown_parcel(GetParam(), Boundary::walls, side * 4.2, side * 5.0F);
    EXPECT_NEAR(after.position[0].x * kUnit, side * 4.3, 4.0 * kUnit);
    EXPECT_NEAR(after.position[0].y * kUnit, 0.1, 2.0 * kUnit);
    EXPECT_EQ(after.velocity[0].x, side * -5.0F);
  }
}

TEST_P(ParcelAtEdge, PeriodicEdgeWrapsByTheOvershoot) {
  for (const float side : {1.0F, -1.0F}) {
    const ParcelSnapshot after = flown_parcel(GetParam(), Boundary::periodic, side * 4.8, side * 5.0F);
    EXPECT_NEAR(after.position[0].x * kUnit, side * -4.7, 4.0 * kUnit);
    EXPECT_EQ(after.velocity[0].x, side * 5.0F);
  }
}

// An open edge retires a parcel when its centre reaches 5 m, not its rim.
TEST_P(ParcelAtEdge, OpenEdgeRetiresTheCentre) {
  for (const float side : {1.0F, -1.0F}) {
    EXPECT_FALSE(
        is_retired(flown_parcel(GetParam(), Boundary::open, side * 4.499999, side * 5.0F).position[0]));
    EXPECT_TRUE(
        is_retired(flown_parcel(GetParam(), Boundary::open, side * 4.500001, side * 5.0F).position[0]));
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, ParcelAtEdge, testing::Values(Method::impulse, Method::exact));

// Two images half a period away are equally near. The left one counts, for either of the two parcels. No
// collision depends on the choice: bodies that would touch across half a world are rejected, or collide with
// both images alike. But sorting, wrapping and searching must agree on one image, and a wrapped position must
// not lie on the upper edge of the world, which belongs to the other side.
TEST(NearestImage, LiesInTheHalfOpenPeriod) {
  for (const std::int32_t half : {kHalfSide, kHalfSide / 3}) {
    for (const std::int32_t from : {-half, -1, 0, 7, half - 1}) {
      for (const std::int64_t d : {-half, -half + 1, -5, 0, half - 1}) {
        std::int64_t to = static_cast<std::int64_t>(from) + d;
        if (to < -half) to += 2LL * half;
        if (to >= half) to -= 2LL * half;
        EXPECT_EQ(axis_separation<Boundary::periodic>(from, static_cast<std::int32_t>(to), half), d)
            << "from " << from << ", half " << half;
      }
    }
    EXPECT_EQ(axis_separation<Boundary::periodic>(0, half, half), -half);
    EXPECT_EQ(axis_separation<Boundary::periodic>(half, 0, half), -half);
  }
}

// Method `exact`, in doubles: the result lies within half a period and differs from the input by whole
// periods.
TEST(NearestImage, OfALongOffsetDiffersByWholePeriods) {
  const std::int32_t half = kHalfSide / 3;
  for (int periods = -5; periods <= 5; ++periods) {
    for (const double d : {-0.49, -0.2, 0.0, 0.3, 0.49}) {
      const double offset = std::floor(d * 2.0 * half);
      EXPECT_EQ(nearest_image(offset + periods * (2.0 * half), half), offset) << periods;
      EXPECT_EQ(wrapped(static_cast<std::int64_t>(offset) + periods * 2LL * half, half),
                static_cast<std::int64_t>(offset));
    }
  }
}

}  // namespace
}  // namespace pf::test
