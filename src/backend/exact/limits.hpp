// Requests that method `exact` refuses.
#pragma once

#include <fmt/format.h>

#include "backend/backend.hpp"
#include "core/error.hpp"

namespace pf {

// Throws UserError if end_s, seconds since the reset, is more than 2^62 ticks of tick_s.
inline void check_is_countable(double end_s, double tick_s) {
  if (end_s / tick_s < 0x1p62) return;
  throw UserError(fmt::format(
      "exact counts time in ticks of {:.3g} ns, at most 2^62 of them; these steps would exceed that. "
      "Take shorter steps, or reset.",
      1e9 * tick_s));
}

// A window of one tick has more events than can be solved in order.
inline UnresolvableError unresolvable(double tick_s, const StepReport& done) {
  return {fmt::format("exact: more parcels touch within a tick of {:.3g} ns than can be resolved in order; "
                      "start with fewer parcels, a lower area fraction or another method",
                      1e9 * tick_s),
          done};
}

}  // namespace pf
