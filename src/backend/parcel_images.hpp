// Pictures of parcels that no single memory holds: counted where the parcels are, or gathered within a view.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "backend/draw_buffers.hpp"

namespace pf {

// Pixels of a picture, from its lower left corner, as the View block of shaders/common.glsl has them.
struct PixelGrid {
  Vec2f center_m, anchor_px;  // anchor_px is where center_m is seen
  Vec2f origin_px;            // of the pixels within the picture
  float m_per_px = 1.0F;
  std::uint32_t width = 0, height = 0;
};

// Parameters of the count of parcels per pixel, which shaders/splat_resolve.comp turns into colours.
struct CountStyle {
  float color_per_mps = 1.0F;  // speed to place on the colour scale
  std::uint32_t one_in = 1;    // one of this many parcels is counted
};

constexpr std::uint32_t kNoPixel = UINT32_MAX;

// A parcel's place in the picture, or kNoPixel outside of it.
PF_HD inline std::uint32_t pixel_of(const PixelGrid& grid, Vec2f position_m) {
  const float x = (position_m.x - grid.center_m.x) / grid.m_per_px + grid.anchor_px.x - grid.origin_px.x;
  const float y = (position_m.y - grid.center_m.y) / grid.m_per_px + grid.anchor_px.y - grid.origin_px.y;
  if (!(x >= 0.0F && y >= 0.0F && x < static_cast<float>(grid.width) && y < static_cast<float>(grid.height)))
    return kNoPixel;
  return static_cast<std::uint32_t>(y) * grid.width + static_cast<std::uint32_t>(x);
}

// A parcel's addend to its pixel: one to the count in the low 13 bits, its level on the colour scale above.
PF_HD inline std::uint32_t pixel_share(const CountStyle& style, float speed_mps) {
  const float level = fminf(fmaxf(speed_mps * style.color_per_mps, 0.0F), 1.0F) * 63.0F + 0.5F;
  return (static_cast<std::uint32_t>(level) << 13U) | 1U;
}

// Both may be called between submit() and collect(), too.
class ParcelImages {
 public:
  virtual ~ParcelImages() = default;

  // Sums over the parcels, grid.width x grid.height values.
  virtual std::vector<std::uint32_t> count(const PixelGrid& grid, const CountStyle& style) = 0;
  // The parcels whose centres are in the picture.
  virtual std::vector<DrawnParcel> gather(const PixelGrid& grid) = 0;
};

}  // namespace pf
