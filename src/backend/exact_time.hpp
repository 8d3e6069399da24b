// How much time method `exact` can count.
#pragma once

#include <string>

#include "core/error.hpp"

namespace pf {

// Throws UserError if end_s, seconds since the reset, is more than 2^62 ticks of tick_s.
inline void check_is_countable(double end_s, double tick_s) {
  if (end_s / tick_s < 0x1p62) return;
  throw UserError(
      "exact counts time in ticks of " + std::to_string(tick_s * 1e9) +
      " ns, at most 2^62 of them, which these steps would exceed; take shorter ones, or start anew");
}

}  // namespace pf
