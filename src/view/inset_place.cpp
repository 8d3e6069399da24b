#include "view/inset_place.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pf {
namespace {

bool is_clear(const PxRect& place, const InsetRequest& request) {
  const PxRect inner = grown(request.free, 1.0F - request.margin_px);  // places are whole pixels
  return is_within(place, inner) && overlap_px2(place, request.keep_clear) == 0.0F;
}

// Corners of the free region, the middles of its edges, and places beside what must stay clear.
std::vector<PxRect> candidates(const InsetRequest& request) {
  const float side = request.side_px;
  const float margin = request.margin_px;
  const PxRect inner = grown(request.free, -margin);
  std::vector<float> lefts = {inner.x1 - side, inner.x0, 0.5F * (inner.x0 + inner.x1 - side)};
  std::vector<float> tops = {inner.y1 - side, inner.y0, 0.5F * (inner.y0 + inner.y1 - side)};
  for (const PxRect& clear : request.keep_clear) {
    lefts.insert(lefts.end(), {clear.x1 + margin, clear.x0 - margin - side});
    tops.insert(tops.end(), {clear.y1 + margin, clear.y0 - margin - side});
  }
  std::vector<PxRect> places;
  for (const float top : tops) {
    for (const float left : lefts) {
      const float x = std::floor(left);  // whole pixels: the picture in it is copied there
      const float y = std::floor(top);
      places.push_back({x, y, x + side, y + side});
    }
  }
  return places;
}

std::size_t num_within(const PxRect& place, const std::vector<Vec2f>& points) {
  return static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [&](Vec2f p) {
    return p.x > place.x0 && p.x < place.x1 && p.y > place.y0 && p.y < place.y1;
  }));
}

}  // namespace

std::optional<PxRect> place_inset(const InsetRequest& request) {
  if (request.before && request.before->width() == request.side_px && is_clear(*request.before, request))
    return request.before;
  std::optional<PxRect> best;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const PxRect& place : candidates(request)) {
    if (!is_clear(place, request)) continue;
    const std::size_t covered = num_within(place, request.path_px);
    if (covered >= fewest) continue;
    fewest = covered;
    best = place;
  }
  return best;
}

std::vector<PxRect> place_labels(const std::vector<PxRect>& wanted, const PxRect& free,
                                 std::vector<PxRect> taken) {
  constexpr std::array<std::array<float, 2>, 8> kDirections = {
      {{0, -1}, {1, 0}, {-1, 0}, {0, 1}, {1, -1}, {-1, -1}, {1, 1}, {-1, 1}}};
  constexpr int kRings = 6;
  std::vector<PxRect> placed;
  for (const PxRect& label : wanted) {
    const auto moved = [&](float right, float down) {
      const float x = std::clamp(label.x0 + right, free.x0, std::max(free.x1 - label.width(), free.x0));
      const float y = std::clamp(label.y0 + down, free.y0, std::max(free.y1 - label.height(), free.y0));
      return PxRect{x, y, x + label.width(), y + label.height()};
    };
    PxRect place = moved(0.0F, 0.0F);
    for (int ring = 1; ring <= kRings && overlap_px2(place, taken) > 0.0F; ++ring) {
      for (const auto& [right, down] : kDirections) {
        const auto steps = static_cast<float>(ring);
        const PxRect there = moved(right * steps * label.width(), down * steps * label.height());
        if (overlap_px2(there, taken) > 0.0F) continue;
        place = there;
        break;
      }
    }
    taken.push_back(place);
    placed.push_back(place);
  }
  return placed;
}

}  // namespace pf
