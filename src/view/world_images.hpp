// Images of a periodic world that a picture shows beyond its edges.
#pragma once

#include <cmath>
#include <vector>

#include "view/camera.hpp"
#include "view/context.hpp"

namespace pf {

// Cameras that show the world where its images are; the camera itself where there are none. origin_px: the
// picture's lower left corner. reach_m: of what is drawn, beyond its place.
inline std::vector<Camera> image_cameras(const Camera& camera, const World& world, Vec2i origin_px,
                                         SizePx size, double reach_m) {
  if (!camera.shows_images || world.boundary != Boundary::periodic) return {camera};
  constexpr double kMaxImages = 4.0;  // in a direction
  const Vec2d half_m = to_metres(world, world.half);
  const Vec2d low_m = camera.to_world(to_double(origin_px));
  const Vec2d high_m =
      low_m + Vec2d{static_cast<double>(size.width), static_cast<double>(size.height)} * camera.metres_per_px;
  const auto first = [&](double low, double half) {
    return std::max(std::ceil((low - half - reach_m) / (2.0 * half)), -kMaxImages);
  };
  const auto last = [&](double high, double half) {
    return std::min(std::floor((high + half + reach_m) / (2.0 * half)), kMaxImages);
  };
  std::vector<Camera> cameras;
  for (double j = first(low_m.y, half_m.y); j <= last(high_m.y, half_m.y); ++j) {
    for (double i = first(low_m.x, half_m.x); i <= last(high_m.x, half_m.x); ++i) {
      cameras.push_back(camera);
      cameras.back().center_m -= Vec2d{2.0 * i * half_m.x, 2.0 * j * half_m.y};
    }
  }
  return cameras;
}

}  // namespace pf
