// Rectangles of the picture, in pixels from its top left.
#pragma once

#include <algorithm>
#include <span>

namespace pf {

struct PxRect {
  float x0 = 0.0F;
  float y0 = 0.0F;
  float x1 = 0.0F;
  float y1 = 0.0F;

  float width() const { return x1 - x0; }
  float height() const { return y1 - y0; }
  bool operator==(const PxRect&) const = default;
};

// Area that both have.
inline float overlap_px2(const PxRect& a, const PxRect& b) {
  const float width = std::min(a.x1, b.x1) - std::max(a.x0, b.x0);
  const float height = std::min(a.y1, b.y1) - std::max(a.y0, b.y0);
  return width > 0.0F && height > 0.0F ? width * height : 0.0F;
}

inline float overlap_px2(const PxRect& a, std::span<const PxRect> others) {
  float area = 0.0F;
  for (const PxRect& other : others) area += overlap_px2(a, other);
  return area;
}

inline bool is_within(const PxRect& inner, const PxRect& outer) {
  return inner.x0 >= outer.x0 && inner.y0 >= outer.y0 && inner.x1 <= outer.x1 && inner.y1 <= outer.y1;
}

inline PxRect grown(const PxRect& a, float by) { return {a.x0 - by, a.y0 - by, a.x1 + by, a.y1 + by}; }
inline PxRect square_around(float x, float y, float half) { return {x - half, y - half, x + half, y + half}; }

}  // namespace pf
