// Floats as fixed-point numbers and back.
#include "core/fixed_point.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace pf {
namespace {

constexpr int kBits = 20;
constexpr double kOne = 1 << kBits;

TEST(FixedPoint, IsTheNearest) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> power(-30.0F, 29.9F);
  for (int k = 0; k < 100000; ++k) {
    const float value = std::exp2(power(random)) * (k % 2 == 0 ? 1.0F : -1.0F);
    const std::int64_t counts = to_fixed<kBits>(value);
    EXPECT_EQ(counts, std::llrint(static_cast<double>(value) * kOne)) << value;
    EXPECT_EQ(to_fixed<kBits>(-value), -counts) << value;
  }
  EXPECT_EQ(to_fixed<kBits>(0.0F), 0);
  EXPECT_EQ(to_fixed<1>(0.25F), 0) << "ties to even";
  EXPECT_EQ(to_fixed<1>(0.75F), 2);
}

TEST(FixedPoint, MarksWhatIsNotFiniteOrTooLarge) {
  using Limits = std::numeric_limits<float>;
  for (const float value :
       {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), 0x1p30F, -0x1p30F, 3e38F})
    EXPECT_EQ(to_fixed<kBits>(value), INT64_MIN) << value;
}

// Rounded once.
TEST(FixedPoint, GivesTheNearestFloat) {
  std::mt19937_64 random(4);
  for (int k = 0; k < 100000; ++k) {
    const auto counts = static_cast<std::int64_t>(random()) >> (k % 60);
    EXPECT_EQ(from_fixed<kBits>(counts), static_cast<float>(counts) / static_cast<float>(kOne)) << counts;
  }
  EXPECT_EQ(from_fixed<kBits>(3), 3.0F / static_cast<float>(kOne));
}

TEST(FixedPoint, TellsWhatAProductLost) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  for (int k = 0; k < 100000; ++k) {
    const float a = uniform(random), b = 1e6F * uniform(random), product = a * b;
    const float lost = lost_in_product(a, b, product);
    EXPECT_EQ(lost, std::fma(a, b, -product));
    EXPECT_EQ(static_cast<double>(product) + static_cast<double>(lost),
              static_cast<double>(a) * static_cast<double>(b));
  }
}

// Squared distances of position units.
TEST(FixedPoint, ConvertsLargeIntegers) {
  for (const std::uint64_t value : {std::uint64_t{0}, std::uint64_t{16777216}, std::uint64_t{1} << 62,
                                    (std::uint64_t{5} << 40) + 12345}) {
    EXPECT_NEAR(to_float(value), static_cast<double>(value), 0x1p-23 * static_cast<double>(value));
  }
}

}  // namespace
}  // namespace pf
