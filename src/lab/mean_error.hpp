// Mean of a list of values and its standard error from their scatter.
#pragma once

#include <cmath>
#include <vector>

namespace pf {

struct MeanError {
  double mean, sigma;
};

// values: at least one; sigma is 0 for one.
inline MeanError mean_and_error(const std::vector<double>& values) {
  double sum = 0.0, squares = 0.0;
  for (const double value : values) sum += value;
  const double n = static_cast<double>(values.size()), mean = sum / n;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, n > 1.0 ? std::sqrt(squares / (n * (n - 1.0))) : 0.0};
}

}  // namespace pf
