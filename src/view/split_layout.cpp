#include "view/split_layout.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pf {
namespace {

constexpr double kDivider_px = 4.0;  // layout pixels

double fitted_m_per_px(const ViewRegion& region, const World& world, float scale) {
  Camera camera;
  fit_world(camera, world, region, scale);
  return camera.metres_per_px;
}

// Cuts a strip for the card off the region, at the right or at the top.
ViewRegion without_card(ViewRegion region, const LegendSize& card, bool at_right) {
  if (at_right) {
    region.width_px = std::max(region.width_px - card.width_px, 1.0);
  } else {
    region.height_px = std::max(region.height_px - card.height_px, 1.0);
  }
  return region;
}

// The upper or left part, and the other.
std::array<ViewRegion, 2> parts_of(const ViewRegion& whole, double share, bool stacked) {
  ViewRegion first = whole;
  ViewRegion second = whole;
  if (stacked) {
    second.height_px = std::round((1.0 - share) * whole.height_px);
    first.bottom_px = whole.bottom_px + second.height_px;
    first.height_px = whole.height_px - second.height_px;
  } else {
    first.width_px = std::round(share * whole.width_px);
    second.left_px = whole.left_px + first.width_px;
    second.width_px = whole.width_px - first.width_px;
  }
  return {first, second};
}

ViewRegion whole_pixels(const ViewRegion& region) {
  const double left = std::round(region.left_px);
  const double bottom = std::round(region.bottom_px);
  return {left, bottom, std::max(std::round(region.left_px + region.width_px) - left, 1.0),
          std::max(std::round(region.bottom_px + region.height_px) - bottom, 1.0)};
}

ViewRegion divider_of(const ViewRegion& second, bool stacked, double width_px) {
  if (stacked)
    return {second.left_px, second.bottom_px + second.height_px - 0.5 * width_px, second.width_px, width_px};
  return {second.left_px - 0.5 * width_px, second.bottom_px, width_px, second.height_px};
}

// Beside the divider where there is a column for it, else in the strip at the top.
ViewRegion card_place(const ViewRegion& free, const LegendSize& card, bool at_right, double middle_px) {
  const double top_px = free.bottom_px + free.height_px - card.height_px;
  const double right_px = free.left_px + free.width_px - card.width_px;
  if (!at_right) {
    const double centred = free.left_px + 0.5 * (free.width_px - card.width_px);
    return {std::max(centred, free.left_px), top_px, card.width_px, card.height_px};
  }
  const double bottom_px =
      std::clamp(middle_px - 0.5 * card.height_px, free.bottom_px, std::max(top_px, free.bottom_px));
  return {std::max(right_px, free.left_px), bottom_px, card.width_px, card.height_px};
}

}  // namespace

SplitLayout lay_out_halves(const ViewRegion& free, const LegendSize& card, const World& world, double share,
                           float scale) {
  share = std::clamp(share, kMinShare, kMaxShare);
  bool stacked = true;
  bool at_right = true;
  double best = 0.0;
  for (const bool is_stacked : {true, false}) {
    for (const bool is_at_right : {true, false}) {
      const ViewRegion tried = parts_of(without_card(free, card, is_at_right), 0.5, is_stacked)[0];
      const double m_per_px = fitted_m_per_px(tried, world, scale);
      if (best > 0.0 && m_per_px >= 0.98 * best) continue;
      best = m_per_px;
      stacked = is_stacked;
      at_right = is_at_right;
    }
  }
  SplitLayout layout;
  layout.stacked = stacked;
  // A card's column covers a part of halves above each other; else its strip belongs to no half.
  layout.halves = at_right && stacked ? free : without_card(free, card, at_right);
  layout.second_half = whole_pixels(parts_of(layout.halves, share, stacked)[1]);
  const auto [first, second] = parts_of(without_card(free, card, at_right), share, stacked);
  layout.first = first;
  layout.second = second;
  layout.divider = divider_of(layout.second_half, stacked, std::max(kDivider_px * scale, 1.0));
  layout.card = card_place(free, card, at_right, layout.divider.center_px().y);
  return layout;
}

SplitLayout lay_out_one(const ViewRegion& free, const LegendSize& card, const World& world, float scale) {
  const bool at_right = fitted_m_per_px(without_card(free, card, true), world, scale) <
                        0.95 * fitted_m_per_px(without_card(free, card, false), world, scale);
  SplitLayout layout;
  layout.first = layout.second = without_card(free, card, at_right);
  layout.halves = layout.first;
  layout.second_half = layout.divider = {0.0, 0.0, 0.0, 0.0};
  layout.card = card_place(free, card, at_right, free.bottom_px + free.height_px);
  return layout;
}

double share_at(Vec2d pointer_px, const SplitLayout& layout) {
  const ViewRegion& halves = layout.halves;
  const double share = layout.stacked ? 1.0 - (pointer_px.y - halves.bottom_px) / halves.height_px
                                      : (pointer_px.x - halves.left_px) / halves.width_px;
  return std::clamp(share, kMinShare, kMaxShare);
}

}  // namespace pf
