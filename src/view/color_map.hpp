// The speed colours on the CPU, for the legend: the same text as speed_color in shaders/common.glsl.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/settings.hpp"
#include "view/look.hpp"

namespace pf {

// Speed of the top colour: four times the parcels' own spread, so that air at rest uses the lower half of the
// scale and parcels that the ball has hit stand out; that of the flow; and a fifth of a hot disc's, which
// cools as it spreads.
inline double top_color_speed_mps(const Settings& settings) {
  const double flow_mps = std::hypot(settings.flow_x_mps, settings.flow_y_mps);
  const double top_mps = 4.0 * settings.parcel_speed_mps + flow_mps + 0.2 * settings.hot_speed_mps;
  return top_mps > 0.0 ? top_mps : 1.0;
}

// The part of the map that is used; the rest would not show on the floor. Fast is bright on the dark floor
// and dark on the light one.
struct MapRange {
  float low, high;
};
inline MapRange map_range(Theme theme) {
  return theme == Theme::light ? MapRange{0.72F, 0.0F} : MapRange{0.28F, 1.0F};
}

// Sixth-order fits of viridis (van der Walt and Smith 2015) and cividis (Nunez, Anderton and Renslow 2018,
// within 0.04), and a grey ramp. Lightness rises all the way in each, also for colour-blind eyes.
inline Rgb color_at(ColorMap map, float t) {
  constexpr float kViridis[7][3] = {
      {0.2777273272F, 0.0054073445F, 0.3340998053F},   {0.1050930431F, 1.4046135299F, 1.3845901628F},
      {-0.3308618287F, 0.2148475595F, 0.0950951630F},  {-4.6342304990F, -5.7991009734F, -19.3324409563F},
      {6.2282699363F, 14.1799333668F, 56.6905526007F}, {4.7763849977F, -13.7451453777F, -65.3530326334F},
      {-5.4354558559F, 4.6458526122F, 26.3124352496F}};
  constexpr float kCividis[7][3] = {
      {-0.0089734425F, 0.1367558936F, 0.2941701871F},     {-0.3846890463F, 0.6394937024F, 2.9826539258F},
      {15.4292103485F, 0.3855616507F, -22.3637603722F},   {-58.9770314611F, -1.4041971194F, 74.8635610979F},
      {102.3704915104F, 2.6009142965F, -121.3031642206F}, {-83.1872389608F, -2.1407503893F, 93.9742163957F},
      {25.7760701436F, 0.6881223150F, -28.2625330184F}};
  if (map == ColorMap::grey) return {t, t, t};
  const auto& terms = map == ColorMap::cividis ? kCividis : kViridis;
  Rgb rgb{};
  for (int term = 6; term >= 0; --term) {
    for (std::size_t i = 0; i < 3; ++i) rgb[i] = rgb[i] * t + terms[term][i];
  }
  for (float& value : rgb) value = std::clamp(value, 0.0F, 1.0F);
  return rgb;
}

// For t in [0, 1], slow to fast.
inline Rgb speed_color(float t, const Look& look) {
  const MapRange range = map_range(look.theme);
  return color_at(look.color_map, range.low + (range.high - range.low) * std::clamp(t, 0.0F, 1.0F));
}

}  // namespace pf
