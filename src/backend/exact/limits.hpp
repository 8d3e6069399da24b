// Requests that method `exact` refuses.
#pragma once

#include <string>

#include "core/error.hpp"

namespace pf {

// Throws UserError if end_s, seconds since the reset, is more than 2^62 ticks of tick_s.
inline void check_is_countable(double end_s, double tick_s) {
  if (end_s / tick_s < 0x1p62) return;
  throw UserError("exact counts time in ticks of " + std::to_string(tick_s * 1e9) +
                  " ns, at most 2^62 of them; these steps would exceed that. Take shorter steps, or reset.");
}

// Throws UserError: a window of one tick has more events than can be solved in order. The state is that of
// the window's start.
[[noreturn]] inline void throw_unresolvable(double tick_s) {
  throw UserError(
      "exact: more parcels touch within a tick of " + std::to_string(tick_s * 1e9) +
      " ns than can be resolved in order; start with fewer parcels, a lower area fraction or another method");
}

}  // namespace pf
