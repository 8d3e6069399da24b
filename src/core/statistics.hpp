// Median and percentiles of measured values. Every report takes them here, so that all treat even and small
// numbers of values alike.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace pf {

struct MedianP99 {
  double median = 0.0;
  double p99 = 0.0;  // smallest value that 99 % do not exceed
};

// Returns the value at index `rank` of the sorted values. rank < values.size(). Reorders values.
inline double value_of_rank(std::span<double> values, std::size_t rank) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// Median; of an even number of values the mean of the two in the middle. Needs one value; reorders them.
inline double median_of(std::span<double> values) {
  const std::size_t num = values.size();
  const double lower = value_of_rank(values, (num - 1) / 2);
  return 0.5 * (lower + value_of_rank(values, num / 2));
}

// The smallest value that a share of them, in (0, 1], does not exceed. At least one value; reorders them.
inline double value_of_share(std::span<double> values, double share) {
  const double num = std::ceil(share * static_cast<double>(values.size()));
  return value_of_rank(values, static_cast<std::size_t>(num) - 1);
}

// Returns zeros if there are no values. Reorders them.
inline MedianP99 median_and_p99(std::span<double> values) {
  if (values.empty()) return {};
  return {median_of(values), value_of_rank(values, (99 * values.size() + 99) / 100 - 1)};
}

}  // namespace pf
