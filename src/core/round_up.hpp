// Round numbers for axes and bounds.
#pragma once

#include <algorithm>
#include <cmath>

namespace pf {

// Smallest of 1, 2 and 5 times a power of ten that is at least value, up to rounding; value below 1e-6 counts
// as 1e-6.
inline double round_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(std::max(value, 1e-6))));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= value * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

}  // namespace pf
