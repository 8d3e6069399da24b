// Layout of two flights in a picture: two halves with a divider, or one picture, with figures beside them.
// Pixels count from the lower left corner.
#pragma once

#include "view/camera.hpp"
#include "view/legend_place.hpp"

namespace pf {

struct SplitLayout {
  bool stacked = true;       // one half above the other, else beside each other
  ViewRegion halves;         // both, whole
  ViewRegion first, second;  // filled by a world that is fitted
  ViewRegion second_half;    // all of it; empty in one picture
  ViewRegion divider;        // the line between the halves
  ViewRegion card;           // the figures

  bool operator==(const SplitLayout&) const = default;
};

// Part of the first half in the split region.
constexpr double kMinShare = 0.15;
constexpr double kMaxShare = 0.85;

// Chooses the direction of the split and the side of the card for which equal halves show the world largest.
// free: what neither panel nor overlay covers; scale: pixels per layout pixel.
SplitLayout lay_out_halves(const ViewRegion& free, const LegendSize& card, const World& world, double share,
                           float scale);
// Both flights in one region.
SplitLayout lay_out_one(const ViewRegion& free, const LegendSize& card, const World& world, float scale);

// The share for a divider that is dragged to a pointer.
double share_at(Vec2d pointer_px, const SplitLayout& layout);

inline bool contains(const ViewRegion& region, Vec2d px, double margin_px = 0.0) {
  return px.x >= region.left_px - margin_px && px.x < region.left_px + region.width_px + margin_px &&
         px.y >= region.bottom_px - margin_px && px.y < region.bottom_px + region.height_px + margin_px;
}

}  // namespace pf
