// Places the legend of the flights beside the world, not over it. Pixels count from the lower left
// corner.
#pragma once

#include <algorithm>
#include <array>

#include "view/camera.hpp"

namespace pf {

// With its margins. 0: there is no legend.
struct LegendSize {
  double width_px = 0.0;
  double height_px = 0.0;
};

// The part of the free region that is left to a world that is fitted: below the legend, or at its left if the
// world becomes larger there by a twentieth.
inline ViewRegion region_beside(const ViewRegion& free, const LegendSize& legend, const World& world,
                                float scale) {
  ViewRegion below = free;
  below.height_px = std::max(free.height_px - legend.height_px, 1.0);
  ViewRegion at_left = free;
  at_left.width_px = std::max(free.width_px - legend.width_px, 1.0);
  Camera fits_below, fits_at_left;
  fit_world(fits_below, world, below, scale);
  fit_world(fits_at_left, world, at_left, scale);
  return fits_at_left.metres_per_px < 0.95 * fits_below.metres_per_px ? at_left : below;
}

// The rectangle of the picture that the world fills.
inline ViewRegion region_of_world(const Camera& camera, const World& world) {
  const Vec2d half_px = to_metres(world, world.half) * (1.0 / camera.metres_per_px);
  const Vec2d center_px = camera.anchor_px - camera.center_m * (1.0 / camera.metres_per_px);
  return {center_px.x - half_px.x, center_px.y - half_px.y, 2.0 * half_px.x, 2.0 * half_px.y};
}

inline double overlap_px2(const ViewRegion& a, const ViewRegion& b) {
  const auto shared = [](double a_low, double a_size, double b_low, double b_size) {
    return std::max(std::min(a_low + a_size, b_low + b_size) - std::max(a_low, b_low), 0.0);
  };
  return shared(a.left_px, a.width_px, b.left_px, b.width_px) *
         shared(a.bottom_px, a.height_px, b.bottom_px, b.height_px);
}

// The legend's rectangle, in the corner of the free region where it covers least of the world; in the upper
// right one if it covers as little there.
inline ViewRegion place_legend(const ViewRegion& free, const LegendSize& legend, const ViewRegion& world) {
  const double right_px = free.left_px + std::max(free.width_px - legend.width_px, 0.0);
  const double top_px = free.bottom_px + std::max(free.height_px - legend.height_px, 0.0);
  const auto at = [&](double left_px, double bottom_px) {
    return ViewRegion{left_px, bottom_px, legend.width_px, legend.height_px};
  };
  const std::array<ViewRegion, 4> corners = {at(right_px, top_px), at(free.left_px, top_px),
                                             at(right_px, free.bottom_px), at(free.left_px, free.bottom_px)};
  return *std::min_element(corners.begin(), corners.end(), [&](const ViewRegion& a, const ViewRegion& b) {
    return overlap_px2(a, world) < overlap_px2(b, world) - 1.0;
  });
}

}  // namespace pf
