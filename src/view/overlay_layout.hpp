// Sizes of the overlay's strip in layout pixels, and where its columns begin.
#pragma once

#include "view/overlay.hpp"

namespace pf {

constexpr float kRow_px = 18.0F;
constexpr int kNumRows = 7;
constexpr float kPadding_px = 12.0F;
constexpr float kStatusWidth_px = 292.0F;
constexpr float kPhasesWidth_px = 330.0F;
constexpr float kPhaseGap_px = 18.0F;  // between the two columns of phases
constexpr float kLegendWidth_px = 140.0F;
constexpr float kMinPlot_px = 50.0F;
constexpr float kTermsRow_px = 21.0F;  // the line above the strip
constexpr float kGap_px = 22.0F;

// In screen pixels.
struct Columns {
  float top, status, phases, plot, plot_width, legend;
  bool has_plot, has_legend;
};

inline Columns columns_of(const OverlayPlace& place) {
  const float s = place.scale;
  Columns at{};
  at.top = place.bottom_px - Overlay::height_px(OverlayMode::full, s) + kPadding_px * s;
  at.status = place.left_px + kPadding_px * s;
  at.phases = at.status + (kStatusWidth_px + kGap_px) * s;
  at.plot = at.phases + (kPhasesWidth_px + kGap_px) * s;
  float right = place.left_px + place.width_px - kPadding_px * s;
  at.has_legend = right - at.plot > kLegendWidth_px * s;
  at.legend = right - kLegendWidth_px * s;
  if (at.has_legend) right = at.legend - kGap_px * s;
  at.plot_width = right - at.plot;
  at.has_plot = at.plot_width > kMinPlot_px * s;
  return at;
}

}  // namespace pf
