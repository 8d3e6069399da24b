// Round numbers for axes and bounds.
#include "core/round_up.hpp"

#include <gtest/gtest.h>

namespace pf {
namespace {

TEST(RoundUp, GivesTheNextOfOneTwoAndFive) {
  EXPECT_DOUBLE_EQ(round_up(1.1), 2.0);
  EXPECT_DOUBLE_EQ(round_up(0.021), 0.05);
  EXPECT_DOUBLE_EQ(round_up(501.0), 1000.0);
  EXPECT_DOUBLE_EQ(round_up(9.99), 10.0);
}

TEST(RoundUp, KeepsRoundNumbersThatArithmeticMissed) {
  for (double power = 1e-6; power < 1e12; power *= 10.0) {
    for (double round : {1.0, 2.0, 5.0}) {
      EXPECT_NEAR(round_up(round * power * (1.0 + 1e-12)) / (round * power), 1.0, 1e-9) << round * power;
      EXPECT_NEAR(round_up(round * power * (1.0 - 1e-12)) / (round * power), 1.0, 1e-9) << round * power;
    }
  }
}

TEST(RoundUp, NeverGivesLessThanAMillionth) {
  EXPECT_DOUBLE_EQ(round_up(0.0), 1e-6);
  EXPECT_DOUBLE_EQ(round_up(-3.0), 1e-6);
}

}  // namespace
}  // namespace pf
