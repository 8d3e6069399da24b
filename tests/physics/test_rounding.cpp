// Positions are whole units: what of a move is not whole is rounded up or down at random, without bias, along
// x and y independently, and anew in each step.
#include <gtest/gtest.h>

#include <cmath>

#include "backend/backend.hpp"
#include "backend/cpu_tally.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// A step in which a parcel at speed_mps in x and y moves by half a unit along each.
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
  // Which of the two moves were rounded up.
  Vec2i moved(std::uint32_t id, std::uint64_t step) const {
    CpuTally tally;
    const Parcel self{{0, 0}, velocity, id};
    return finish_step<false, Boundary::periodic>(c, {}, rounding_key(1, step), self, {}, tally).position;
  }
};

// The two up together in a quarter of all, each in half of them: binomial, five standard errors.
void expect_independent_halves(double num_x, double num_y, double num_both, double num) {
  EXPECT_NEAR(num_x / num, 0.5, 5.0 * std::sqrt(0.25 / num));
  EXPECT_NEAR(num_y / num, 0.5, 5.0 * std::sqrt(0.25 / num));
  EXPECT_NEAR(num_both / num, 0.25, 5.0 * std::sqrt(0.25 * 0.75 / num));
}

TEST(Rounding, OfXSaysNothingOfThatOfY) {
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

// Else a parcel would drift by up to half a unit in each step.
TEST(Rounding, OfAStepSaysNothingOfTheNext) {
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

// Over all random numbers a move of k / 2^16 units goes up in k of 2^16 cases, whatever its last bits are up
// to half of one; a move to the other side does as its mirror image.
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

// Both of a pair are pushed by the same fraction of a unit, in opposite directions.
TEST(Rounding, OfAPushOutIsTheSameToBothSides) {
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
    const Vec2i there = pushed(push, -push), back = pushed(-push, push);
    EXPECT_EQ(there.x, -back.x) << push;
    EXPECT_EQ(there.y, -back.y) << push;
    EXPECT_EQ(there.x, std::llround(static_cast<double>(push) / kPushOutUnit)) << push;
  }
}

}  // namespace
}  // namespace pf
