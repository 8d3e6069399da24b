// Colour of the flight that is on its way, in path and legend.
#pragma once

#include "app/simulation.hpp"
#include "view/look.hpp"

namespace pf {

// A colour of its own as long as nothing is compared with it, then that of its method.
inline Rgb current_flight_color(Theme theme, const FrameView& frame) {
  if (frame.old_flights == nullptr) return theme_colors(theme).path;
  const FlightRecord& current = *frame.flight_record;
  return is_compared(current, *frame.old_flights) ? flight_color(theme, current) : theme_colors(theme).path;
}

}  // namespace pf
