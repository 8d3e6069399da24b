// Median and percentiles of measured values.
#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "core/statistics.hpp"

namespace pf {
namespace {

// The values 1 .. num, not in order.
std::vector<double> numbers_to(int num) {
  std::vector<double> values(static_cast<std::size_t>(num));
  std::iota(values.rbegin(), values.rend(), 1.0);
  return values;
}

TEST(Statistics, TheMedianOfAnEvenNumberIsTheMeanOfTheTwoInTheMiddle) {
  for (const auto& [num, median] : {std::pair(1, 1.0), {2, 1.5}, {3, 2.0}, {4, 2.5}, {101, 51.0}}) {
    std::vector<double> values = numbers_to(num);
    EXPECT_EQ(median_of(values), median) << num;
  }
}

TEST(Statistics, NinetyNineInAHundredDoNotExceedThePercentile) {
  for (const auto& [num, p99] : {std::pair(1, 1.0), {99, 99.0}, {100, 99.0}, {101, 100.0}, {1000, 990.0}}) {
    std::vector<double> values = numbers_to(num);
    EXPECT_EQ(median_and_p99(values).p99, p99) << num;
  }
}

TEST(Statistics, AShareDoesNotExceedItsValue) {
  for (const auto& [num, quarter] : {std::pair(1, 1.0), {2, 1.0}, {4, 1.0}, {5, 2.0}, {60, 15.0}}) {
    std::vector<double> values = numbers_to(num);
    EXPECT_EQ(value_of_share(values, 0.25), quarter) << num;
    EXPECT_EQ(value_of_share(values, 1.0), num);
  }
}

TEST(Statistics, NoValuesGiveZeros) {
  EXPECT_EQ(median_and_p99({}).median, 0.0);
  EXPECT_EQ(median_and_p99({}).p99, 0.0);
}

}  // namespace
}  // namespace pf
