// Positions are whole units. The fraction of a displacement is rounded up or down at random: without bias,
// along x and y independently, and independently in each step.
#include <gtest/gtest.h>

#include <cmath>

#include "backend/backend.hpp"
#include "backend/cpu_tally.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// A step in which a parcel moves by half a unit along x and y.
struct HalfAUnit {
  StepConstants c;
  Vec2f velocity;

  HalfAUnit() {
    Physics physics;
    physics.world = make_world(8.0, 8.0, Boundary::periodic);
    physics.parcels = {1, 0.5, 1.0, 1.0, 1.0, 1.0, true};
    c = make_step_constants(physics, 0.5 * physics.world.unit_m, 0.0);
    velocity = {1.0F, 1.0F};
  }
  // 1 along each axis whose displacement was rounded up, else 0.
  Vec2i moved(std::uint32_t id, std::uint64_t step) const {
    CpuTally tally;
    const Parcel self{{0, 0}, velocity, id};
    return finish_step<false, Boundary::periodic>(c, {}, rounding_key(1, step), self, ContactSums{}, tally)
        .position;
  }
};

// Each rounds up in half of all cases, both together in a quarter. The test allows five binomial standard
// errors.
void expect_independent_halves(double num_x, double num_y, double num_both, double num) {
  EXPECT_NEAR(num_x / num, 0.5, 5.0 * std::sqrt(0.25 / num));
  EXPECT_NEAR(num_y / num, 0.5, 5.0 * std::sqrt(0.25 / num));
  EXPECT_NEAR(num_both / num, 0.25, 5.0 * std::sqrt(0.25 * 0.75 / num));
}

TEST(Rounding, IsIndependentInXAndY) {
  const HalfAUnit step;
  constexpr std::uint32_t kNum = 40000;
  Vec2d sum;
  double num_both = 0.0;
  for (std::uint32_t id = 0; id < kNum; ++id) {
    const Vec2i moved = step.moved(id, 3);
    ASSERT_TRUE((moved.x == 0 || moved.x == 1) && (moved.y == 0 || moved.y == 1));
    sum += to_double(moved);
    num_both += moved.x * moved.y;
  }
  expect_independent_halves(sum.x, sum.y, num_both, kNum);
}

// Otherwise a parcel would drift by up to half a unit in each step.
TEST(Rounding, IsIndependentBetweenSteps) {
  const HalfAUnit step;
  constexpr std::uint32_t kNum = 40000;
  double num_up = 0.0, num_next = 0.0, num_both = 0.0;
  for (std::uint64_t k = 0; k < kNum; ++k) {
    const int now = step.moved(17, k).x, next = step.moved(17, k + 1).x;
    num_up += now;
    num_next += next;
    num_both += now * next;
  }
  expect_independent_halves(num_up, num_next, num_both, kNum);
}

// Over all random numbers the mean displacement of a step is velocity times step, up to 2^-16 units: its
// fraction is rounded to that. Steps of up to a sixteenth of the world.
TEST(Rounding, OfAStepHasNoBias) {
  Physics physics;
  physics.world = make_world(8.0, 8.0, Boundary::periodic);
  physics.parcels = {1, 0.5, 1.0, 1.0, 1.0, 1.0, true};
  for (const double dt_s : {1e-9, 3.3e-6, 0.0123, 0.5}) {
    const StepConstants c = make_step_constants(physics, dt_s, 0.0);
    for (const float velocity : {0.7F, -0.7F, 1.0F / 3.0F, -0.123456F, 1e-5F, 0.99999994F}) {
      const double units = static_cast<double>(velocity) * dt_s / physics.world.unit_m;
      const double whole = std::floor(units);
      double sum = 0.0;
      for (std::uint32_t random = 0; random < 65536; ++random)
        sum += static_cast<double>(displacement(c, velocity, random)) - whole;
      EXPECT_NEAR(sum / 65536.0, units - whole, 0x1p-16) << velocity << " m/s for " << dt_s << " s";
    }
  }
}

// Over all random numbers a displacement of k / 2^16 units is rounded up in k of 2^16 cases, whatever its
// lower bits are, up to half of one. A displacement to the other side is rounded as the mirror image.
TEST(Rounding, HasNoBiasInAnyFraction) {
  for (const std::int64_t part : {0, 1, 300, 32768, 65535}) {
    for (const std::int64_t rest : {-32768, -20000, 0, 20000, 32767}) {
      const std::int64_t fixed = part * 65536 + rest;
      std::int64_t sum = 0, mirrored = 0;
      for (std::uint32_t random = 0; random < 65536; ++random) {
        sum += round_at_random(fixed, random);
        mirrored += round_at_random(-fixed, random);
      }
      EXPECT_EQ(sum, part) << "fraction " << fixed << " / 2^32";
      if (rest != -32768) {
        EXPECT_EQ(mirrored, -sum) << "fraction " << fixed << " / 2^32";
      }
    }
  }
}

// Both parcels of a pair are pushed by the same fraction of a unit, in opposite directions.
TEST(Rounding, OfPushOutsIsSymmetric) {
  HalfAUnit step;
  step.velocity = {0.0F, 0.0F};
  const auto pushed = [&](std::int64_t x, std::int64_t y) {
    CpuTally tally;
    ContactSums sums;
    sums.push_x = x;
    sums.push_y = y;
    return finish_step<false, Boundary::periodic>(step.c, {}, 1, {{0, 0}, step.velocity, 0}, sums, tally)
        .position;
  };
  for (const std::int64_t push : {1, 30000, 40000, 65535, 100000, 12345678}) {
    const Vec2i first = pushed(push, -push), second = pushed(-push, push);
    EXPECT_EQ(first.x, -second.x) << push;
    EXPECT_EQ(first.y, -second.y) << push;
    EXPECT_EQ(first.x, std::llround(static_cast<double>(push) / kPushOutUnit)) << push;
  }
}

}  // namespace
}  // namespace pf
