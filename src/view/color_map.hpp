// The speed colours on the CPU, for the legend: the same text as speed_color in shaders/common.glsl.
#pragma once

#include <algorithm>
#include <array>

namespace pf {

// Speed that takes the top colour: four times the parcels' own spread, so that air at rest uses the lower
// half of the scale and what the ball has kicked stands out.
inline double top_color_speed_mps(double parcel_speed_mps, double flow_mps) {
  const double top = 4.0 * parcel_speed_mps + flow_mps;
  return top > 0.0 ? top : 1.0;
}

// Red, green, blue in [0, 1] for t in [0, 1].
inline std::array<float, 3> speed_color(float t) {
  constexpr float kTerms[7][3] = {
      {0.2777273272F, 0.0054073445F, 0.3340998053F},   {0.1050930431F, 1.4046135299F, 1.3845901628F},
      {-0.3308618287F, 0.2148475595F, 0.0950951630F},  {-4.6342304990F, -5.7991009734F, -19.3324409563F},
      {6.2282699363F, 14.1799333668F, 56.6905526007F}, {4.7763849977F, -13.7451453777F, -65.3530326334F},
      {-5.4354558559F, 4.6458526122F, 26.3124352496F}};
  t = 0.28F + 0.72F * std::clamp(t, 0.0F, 1.0F);
  std::array<float, 3> rgb{};
  for (int term = 6; term >= 0; --term) {
    for (std::size_t i = 0; i < 3; ++i) rgb[i] = rgb[i] * t + kTerms[term][i];
  }
  for (float& value : rgb) value = std::clamp(value, 0.0F, 1.0F);
  return rgb;
}

}  // namespace pf
