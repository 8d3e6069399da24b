// The bar below the scene: the current flight's length, the ball's hits, kept checkpoints and changes of
// settings. Dragging on it goes back and forth through the flight.
#pragma once

#include <optional>

#include "app/simulation.hpp"
#include "view/gui.hpp"
#include "view/look.hpp"
#include "view/overlay.hpp"

namespace pf {

struct TimelineWish {
  std::optional<double> seek_s;  // a time of the flight that the pointer has come to
  bool holds = false;            // the button is down
};

// End of the bar's scale for a flight so long: it grows by quarters, so that the marks stand still between.
double timeline_span_s(double flown_s, bool has_ended);

class TimelineBar {
 public:
  static float height_px(float scale) { return 34.0F * scale; }

  // Describes the bar to ImGui. place: its lower edge is that of the bar.
  TimelineWish edit(const FrameView& frame, const OverlayPlace& place, Theme theme, ControlMap& controls);

 private:
  TimelineWish drag(const FrameView& frame, std::int64_t to_frame);

  std::optional<std::int64_t> dragged_to_;  // frame
};

}  // namespace pf
