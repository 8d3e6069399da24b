// The camera, straight above the plane. Pixels count from the lower left corner, as in GL.
#pragma once

#include <algorithm>

#include "core/vec2.hpp"
#include "model/world.hpp"

namespace pf {

// The part of the picture that neither the panel nor the overlay covers.
struct ViewRegion {
  double left_px = 0.0;
  double bottom_px = 0.0;
  double width_px = 1.0;
  double height_px = 1.0;

  Vec2d center_px() const { return {left_px + 0.5 * width_px, bottom_px + 0.5 * height_px}; }
  bool operator==(const ViewRegion&) const = default;
};

// A zoom within the bounds that the width of a world sets.
inline double within_zoom(double metres_per_px, double width_m) {
  return std::clamp(metres_per_px, width_m * 1e-7, width_m * 0.02);
}

struct Camera {
  Vec2d center_m;  // seen at anchor_px
  Vec2d anchor_px;
  double metres_per_px = 0.01;
  bool fitted = true;         // follows the window until the person pans or zooms
  bool shows_images = false;  // of a periodic world, beyond its edges

  Vec2d to_world(Vec2d px) const { return center_m + (px - anchor_px) * metres_per_px; }
  Vec2d to_px(Vec2d world_m) const { return (world_m - center_m) * (1.0 / metres_per_px) + anchor_px; }

  // Shows a world of the given size with a margin around it [px].
  void fit(double width_m, double height_m, const ViewRegion& region, double margin_px) {
    const double free_x = std::max(region.width_px - 2.0 * margin_px, 16.0);
    const double free_y = std::max(region.height_px - 2.0 * margin_px, 16.0);
    metres_per_px = std::max(width_m / free_x, height_m / free_y);
    center_m = {};
    anchor_px = region.center_px();
    shows_images = false;
    fitted = true;
  }
  void pan(Vec2d moved_px) {
    center_m -= moved_px * metres_per_px;
    fitted = false;
  }
  // factor > 1 goes nearer; the world point under the pointer stays there. width_m bounds the zoom.
  void zoom_at(Vec2d pointer_px, double factor, double width_m) {
    const Vec2d fixed_m = to_world(pointer_px);
    metres_per_px = within_zoom(metres_per_px / factor, width_m);
    center_m = fixed_m - (pointer_px - anchor_px) * metres_per_px;
    fitted = false;
  }
};

// Shows all of a world, and strips beyond an open one, through which the ball leaves and in which the posts
// of the net are. scale: pixels per layout pixel.
inline void fit_world(Camera& camera, const World& world, const ViewRegion& region, float scale) {
  constexpr double kMargin_px = 14.0;  // layout pixels
  constexpr double kApron_m = 0.30;    // for a court, which reaches 3.05 m from its middle
  constexpr double kPosts_m = 3.42;    // of the net, from its middle (shaders/court.frag)
  const Vec2d half_m = to_metres(world, world.half);
  const bool is_open = world.boundary == Boundary::open;
  const double as_court = is_open ? std::min(half_m.x, half_m.y) / 3.05 : 0.0;
  const double beyond_m = std::clamp(kPosts_m - half_m.y, 0.0, 0.4 * as_court);
  camera.fit(2.0 * (half_m.x + kApron_m * as_court), 2.0 * (half_m.y + beyond_m), region, kMargin_px * scale);
}

}  // namespace pf
