// The chosen look of the picture, and its colours.
#pragma once

#include <array>
#include <cstdint>
#include <iterator>

#include "model/physics.hpp"

namespace pf {

// In the order of kThemeNames and kColorMapNames (app/options.hpp).
enum class Theme : std::uint8_t { dark, light };
enum class ColorMap : std::uint8_t { viridis, cividis, grey };

struct Look {
  Theme theme = Theme::dark;
  ColorMap color_map = ColorMap::viridis;
  bool paths = true;    // of the ball
  bool ghosts = false;  // its paths in a vacuum and with drag in closed form
};

using Rgb = std::array<float, 3>;  // in [0, 1]

struct ThemeColors {
  Rgb path, path_shadow, ghost;
};

inline const ThemeColors& theme_colors(Theme theme) {
  static const ThemeColors kDark = {{1.0F, 0.93F, 0.45F}, {0.02F, 0.04F, 0.05F}, {0.90F, 0.93F, 0.95F}};
  static const ThemeColors kLight = {{0.07F, 0.09F, 0.16F}, {1.0F, 1.0F, 1.0F}, {0.36F, 0.42F, 0.46F}};
  return theme == Theme::light ? kLight : kDark;
}

// Colour of the flight that began age + 1 flights before the current one. The hues suit colour-blind eyes too
// (Okabe and Ito 2008); they are darker on the light ground.
inline Rgb old_flight_color(Theme theme, std::size_t age) {
  constexpr Rgb kHues[] = {{0.34F, 0.71F, 0.91F},
                           {0.90F, 0.45F, 0.10F},
                           {0.10F, 0.74F, 0.56F},
                           {0.86F, 0.54F, 0.73F},
                           {0.75F, 0.78F, 0.80F}};
  Rgb color = kHues[age % std::size(kHues)];
  if (theme == Theme::light) {
    for (float& part : color) part *= 0.62F;
  }
  return color;
}

// A dash and its gap: long for the vacuum, short for drag.
inline float ghost_dash_px(Air air) { return air == Air::vacuum ? 16.0F : 6.0F; }

}  // namespace pf
