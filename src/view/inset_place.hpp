// Places a square inset and labels in the picture, clear of what must stay readable.
#pragma once

#include <optional>
#include <vector>

#include "core/vec2.hpp"
#include "view/px_rect.hpp"

namespace pf {

struct InsetRequest {
  PxRect free;  // of panel and overlay
  float side_px = 0.0F;
  float margin_px = 0.0F;          // to everything else
  std::vector<PxRect> keep_clear;  // never covered: the ball, legend, notices
  std::vector<Vec2f> path_px;      // covered as little as possible
  std::optional<PxRect> before;    // the place so far, kept while it is good
};

// None if there is no place for it.
std::optional<PxRect> place_inset(const InsetRequest& request);

// Labels near the points they belong to, moved so that none covers another or a taken place, as far as there
// is room. wanted: their rectangles. The result has the same order.
std::vector<PxRect> place_labels(const std::vector<PxRect>& wanted, const PxRect& free,
                                 std::vector<PxRect> taken);

}  // namespace pf
