// Cases that random gases rarely have: grazing collisions of tiny parcels, a ball over the edge, a ball
// without parcels, a crowd that ends a request.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/error.hpp"
#include "exact/exact_support.hpp"
#include "model/exact/collision.hpp"

namespace pf::test {
namespace {

// Pairs that just touch on their way. Each position is rounded to whole units, at the step's start.
TEST(Exact, TheCheapTestLosesNoGrazingCollision) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(0.0, 2.0 * kPi), within(0.0, 1.0), error(-1.0, 1.0);
  for (const double contact : {100.0, 500.0, 2424.0, 77'000.0}) {
    int num_collisions = 0;
    for (int k = 0; k < 50'000; ++k) {
      const double towards = angle(random);
      // Half of them are almost there.
      const double way = k % 2 == 0 ? contact * (0.1 + 2.0 * within(random)) : 3.0 * within(random);
      const Vec2d along = {std::cos(towards), std::sin(towards)};
      // At the closest approach they are up to two units within contact.
      const Vec2d closest = perpendicular(along) * (contact - 2.0 * within(random));
      const Vec2d start = closest - along * way, moved = along * (3.0 * contact);
      if (time_of_impact(start, moved, contact, 1.0) < 0.0) continue;
      ++num_collisions;
      const Vec2i offset = {static_cast<std::int32_t>(std::lround(start.x + error(random))),
                            static_cast<std::int32_t>(std::lround(start.y + error(random)))};
      const Vec2f relative = {static_cast<float>(moved.x), static_cast<float>(moved.y)};
      ASSERT_TRUE(may_collide(offset, relative, static_cast<float>(contact), 1.0F))
          << "contact " << contact << ", offset " << offset.x << ", " << offset.y;
    }
    EXPECT_GT(num_collisions, 20'000);
  }
}

Settings gas_with_ball(Boundary boundary, double x_m) {
  Settings s = exact(gas(400, 0.2, boundary));
  s.ball_present = true;
  s.ball_mass_kg = 20.0;
  s.ball_radius_m = 2.0;
  s.ball_x_m = x_m;
  s.ball_y_m = 0.0;
  s.ball_vx_mps = 2.0;
  s.ball_vy_mps = s.ball_spin_radps = 0.0;
  s.friction = 0.0;
  s.magnus = false;
  return s;
}

// The box is 40 m wide. The ball crosses its edge, or comes back from its wall.
TEST(Exact, ABallAtTheEdgeIsTheSameForAnyStepLength) {
  for (const Boundary boundary : {kPeriodic, kWalls}) {
    const auto hashes = [&](std::uint32_t steps) {
      SceneRun run(gas_with_ball(boundary, 15.0), 1);
      const StepReport report = run.advance(steps, 6.0 / steps);
      EXPECT_GT(report.totals.num_ball_hits, 5U);
      EXPECT_LT(report.ball.position_m.x, 15.0) << "it has not been at the edge";
      return std::pair(report.totals.event_hash, run.backend->state_hash());
    };
    const auto expected = hashes(600);
    for (const std::uint32_t steps : {200U, 57U, 20U}) EXPECT_EQ(hashes(steps), expected) << steps;
  }
}

// Two rows of touching parcels fly at each other. When they meet, at 0.35 s, they have 350 x 350 collisions
// at once.
TEST(Exact, CountsTheStepsBeforeACrowdThatCannotBeResolved) {
  constexpr std::int64_t kHalf = 350;
  SceneRun run(exact(gas(2 * kHalf, 0.001, kPeriodic)), 1);
  ParcelSnapshot rows = run.backend->snapshot();
  const double contact = 2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m;
  for (std::int64_t i = 0; i < 2 * kHalf; ++i) {
    const bool is_right = i >= kHalf;
    const double place = static_cast<double>(i - kHalf) * (contact - 2.5) + (is_right ? 0.7 * contact : 0.0);
    rows.position[i] = {static_cast<std::int32_t>(place), 0};
    rows.velocity[i] = {is_right ? -1.0F : 1.0F, 0.0F};
  }
  run.backend->restore(rows);
  try {
    run.advance(10, 0.1);
    FAIL() << "no error";
  } catch (const UnresolvableError& failure) {
    EXPECT_EQ(failure.report.totals.num_steps, 3U);
  }
  const Vec2i moved = run.backend->snapshot().position[0] - rows.position[0];
  EXPECT_NEAR(static_cast<double>(moved.x) / contact, 0.35, 1e-3);
}

// Whatever may hit the ball lies within a circle: the corners of the square around it are left out.
TEST(Exact, TheBallsNeighbourhoodIsRound) {
  const World world = make_world(100.0, 100.0, Boundary::open);
  const BallNeighbourhood ball{{1000, -2000}, 1 << 30};
  const auto is_near = [&](double x, double y) {
    const Vec2i at = {1000 + static_cast<std::int32_t>(x * 0x1p30),
                      -2000 + static_cast<std::int32_t>(y * 0x1p30)};
    return is_in<kOpen>(ball, world, at);
  };
  EXPECT_TRUE(is_near(1.0, 0.0) && is_near(0.0, -1.0) && is_near(0.707, -0.707));
  EXPECT_FALSE(is_near(0.709, 0.709) || is_near(1.001, 0.0) || is_near(-0.9, -0.9));
}

}  // namespace
}  // namespace pf::test
