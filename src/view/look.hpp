// The chosen look of the picture, and its colours.
#pragma once

#include <array>
#include <cstdint>
#include <iterator>
#include <optional>

#include "app/flight.hpp"
#include "model/methods.hpp"

namespace pf {

// In the order of kThemeNames and kColorMapNames (app/options.hpp).
enum class Theme : std::uint8_t { dark, light };
enum class ColorMap : std::uint8_t { viridis, cividis, grey };

struct Look {
  Theme theme = Theme::dark;
  ColorMap color_map = ColorMap::viridis;
  bool paths = true;    // of the ball
  bool ghosts = false;  // its paths in a vacuum and with drag in closed form
  // Colour of the current flight; none: one of its own, or that of its method.
  std::optional<std::array<float, 3>> flight = std::nullopt;
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

// In the order of Method, as in the lab's figures. The hues suit colour-blind eyes too (Okabe and Ito 2008).
constexpr Rgb kMethodColors[] = {{0.20F, 0.60F, 0.86F}, {0.90F, 0.45F, 0.10F}, {0.10F, 0.74F, 0.56F}};
static_assert(std::size(kMethodColors) == kMethods.size());

// Darker on the light ground.
inline Rgb method_color(Theme theme, Method method) {
  Rgb color = kMethodColors[static_cast<std::size_t>(method)];
  if (theme == Theme::light) {
    for (float& part : color) part *= 0.7F;
  }
  return color;
}

// The colour of the method, paler for half of the scene's step. It does not depend on other flights.
inline Rgb flight_color(Theme theme, const FlightRecord& flight) {
  if (flight.air != Air::parcels) return theme_colors(theme).path;
  Rgb color = method_color(theme, flight.method);
  if (flight.half_step) {
    for (float& part : color) part = 0.5F * (part + 0.85F);
  }
  return color;
}

// A dash and its gap: long for the vacuum, short for drag.
inline float ghost_dash_px(Air air) { return air == Air::vacuum ? 16.0F : 6.0F; }

}  // namespace pf
