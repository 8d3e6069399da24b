// Paints for the overlay and the marks in the scene: colours of the theme, and texts that are made rarely and
// painted often.
#pragma once

#include <imgui.h>

#include <algorithm>
#include <string>
#include <vector>

#include "view/camera.hpp"
#include "view/look.hpp"

namespace pf {

struct OverlayColors {
  ImU32 ground, plot, edge, text, dim, accent, warning, line;
};

inline const OverlayColors& overlay_colors(Theme theme) {
  static const OverlayColors kDark = {IM_COL32(11, 19, 25, 235),    IM_COL32(20, 32, 40, 255),
                                      IM_COL32(38, 56, 66, 255),    IM_COL32(226, 233, 234, 255),
                                      IM_COL32(139, 158, 165, 255), IM_COL32(242, 212, 63, 255),
                                      IM_COL32(238, 110, 110, 255), IM_COL32(255, 255, 255, 90)};
  static const OverlayColors kLight = {IM_COL32(246, 248, 249, 240), IM_COL32(228, 234, 237, 255),
                                       IM_COL32(190, 202, 208, 255), IM_COL32(22, 33, 40, 255),
                                       IM_COL32(84, 103, 113, 255),  IM_COL32(150, 84, 0, 255),
                                       IM_COL32(190, 30, 40, 255),   IM_COL32(0, 0, 0, 110)};
  return theme == Theme::light ? kLight : kDark;
}

inline ImU32 packed(const Rgb& color, float alpha = 1.0F) {
  return ImGui::ColorConvertFloat4ToU32(ImVec4(color[0], color[1], color[2], alpha));
}

// Place of a point of the world in a picture so high, from the upper left corner as ImGui counts.
inline ImVec2 on_screen(Vec2d world_m, const Camera& camera, float height_px) {
  const Vec2d px = camera.to_px(world_m);
  return {static_cast<float>(px.x), height_px - static_cast<float>(px.y)};
}

// size: relative to the font's height.
inline float text_width(const std::string& text, float size = 1.0F) {
  return ImGui::GetFont()->CalcTextSizeA(ImGui::GetFontSize() * size, 1e9F, 0.0F, text.c_str()).x;
}

// The size of secondary text, relative to the font's height. Below 13 pixels it is not reduced: a minus sign
// thinner than a pixel would vanish.
inline float reduced(float size) { return ImGui::GetFontSize() < 13.0F ? 1.0F : size; }

// The size, at most 1, at which a text has the width; never smaller than can be read of large text.
inline float fitting_size(const std::string& text, float width) {
  constexpr float kMinSize = 0.3F;
  return std::clamp(width / std::max(text_width(text), 1.0F), kMinSize, 1.0F);
}

// Shortened with dots to the width, never within a letter of several bytes.
inline std::string fitting(std::string text, float width) {
  if (text_width(text) <= width) return text;
  while (text.size() > 4 && text_width(text + "...") > width) {
    while ((static_cast<unsigned char>(text.back()) & 0xC0U) == 0x80U) text.pop_back();
    text.pop_back();
  }
  return text + "...";
}

// Texts with their places: made a few times a second, painted in every frame.
class TextSheet {
 public:
  void clear() { items_.clear(); }
  void add(float x, float y, ImU32 color, std::string text, float size = 1.0F) {
    items_.push_back({ImVec2(x, y), color, size, std::move(text)});
  }
  void add_right(float right, float y, ImU32 color, std::string text, float size = 1.0F) {
    const float left = right - text_width(text, size);
    add(left, y, color, std::move(text), size);
  }
  void paint(ImDrawList* list) const {
    for (const Item& item : items_)
      list->AddText(ImGui::GetFont(), ImGui::GetFontSize() * item.size, item.at, item.color,
                    item.text.c_str());
  }

 private:
  struct Item {
    ImVec2 at;
    ImU32 color;
    float size;
    std::string text;
  };
  std::vector<Item> items_;
};

}  // namespace pf
