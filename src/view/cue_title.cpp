#include "view/cue_title.hpp"

#include <imgui.h>

#include <algorithm>
#include <initializer_list>

#include "view/overlay_paint.hpp"

namespace pf {
namespace {

constexpr double kFadeIn_s = 0.4;
constexpr double kFadeOut_s = 1.0;
constexpr float kTitleMargin_px = 18.0F;  // layout pixels
constexpr float kTitlePadding_px = 12.0F;
constexpr float kTitleGap_px = 4.0F;  // between title and sub-title

ImU32 faded(ImU32 color, float opacity) {
  ImVec4 parts = ImGui::ColorConvertU32ToFloat4(color);
  parts.w *= opacity;
  return ImGui::ColorConvertFloat4ToU32(parts);
}

// The last font of the Gui is the largest.
ImFont* title_font() { return ImGui::GetIO().Fonts->Fonts.back(); }

// A text of several lines: its font, height of a letter and extent.
struct Paragraph {
  const std::string& text;
  ImFont* font;
  float height_px;
  ImVec2 size;

  Paragraph(const std::string& shown, ImFont* with, float height, float width)
      : text(shown), font(with), height_px(height), size(extent(shown, with, height, width)) {}

  static ImVec2 extent(const std::string& shown, ImFont* with, float height, float width) {
    if (shown.empty()) return {0.0F, 0.0F};
    return with->CalcTextSizeA(height, 1e9F, width, shown.c_str());
  }
  void paint(ImVec2 at, ImU32 color, float width) const {
    if (text.empty()) return;
    ImGui::GetBackgroundDrawList()->AddText(font, height_px, at, color, text.c_str(), nullptr, width);
  }
};

// The largest of some heights at which a text has one line, or else the smallest. sizes: relative to the
// font's.
float fitting_height(const std::string& text, ImFont* font, float width, std::initializer_list<float> sizes) {
  float height = 0.0F;
  for (const float size : sizes) {
    height = size * ImGui::GetFontSize();
    if (font->CalcTextSizeA(height, 1e9F, 0.0F, text.c_str()).x <= width) break;
  }
  return height;
}

// Upper left corner of a rectangle there.
Vec2f place_in(TitleCorner corner, Vec2f size_px, const OverlayPlace& place) {
  const float margin = kTitleMargin_px * place.scale;
  const float right = place.left_px + place.width_px - margin - size_px.x;
  const float low = place.bottom_px - margin - size_px.y;
  return {corner == TitleCorner::lower_right ? right : place.left_px + margin,
          corner == TitleCorner::upper_left ? margin : low};
}

}  // namespace

TitleCorner title_corner(Vec2f size_px, const OverlayPlace& place, const PxRect& keep_clear) {
  for (const TitleCorner corner :
       {TitleCorner::lower_left, TitleCorner::lower_right, TitleCorner::upper_left}) {
    const Vec2f at = place_in(corner, size_px, place);
    if (overlap_px2({at.x, at.y, at.x + size_px.x, at.y + size_px.y}, keep_clear) == 0.0F) return corner;
  }
  return TitleCorner::lower_left;
}

void CueTitle::begin(const Cue& cue) {
  title_ = cue.title;
  subtitle_ = cue.subtitle;
  title_s_ = cue.title_s;
  shown_s_ = 0.0;
  corner_.reset();
}

float CueTitle::opacity() const {
  if (title_.empty() && subtitle_.empty()) return 0.0F;
  const double in = shown_s_ / kFadeIn_s;
  const double out = title_s_ == 0.0 ? 1.0 : (title_s_ - shown_s_) / kFadeOut_s;
  return static_cast<float>(std::clamp(std::min(in, out), 0.0, 1.0));
}

PxRect CueTitle::show(const OverlayPlace& place, Theme theme, const PxRect& keep_clear) {
  const float s = place.scale, width = place.width_px;
  const float opacity_now = opacity();
  if (opacity_now == 0.0F) return {};
  const float room =
      std::max(width - 2.0F * (kTitleMargin_px + kTitlePadding_px) * s, 4.0F * ImGui::GetFontSize());
  const Paragraph title(title_, title_font(),
                        fitting_height(title_, title_font(), room, {2.2F, 1.9F, 1.6F, 1.3F}), room);
  const Paragraph subtitle(subtitle_, title_font(),
                           fitting_height(subtitle_, title_font(), room, {1.25F, 1.0F}), room);
  const float gap = title_.empty() || subtitle_.empty() ? 0.0F : kTitleGap_px * s;
  const Vec2f size = {std::max(title.size.x, subtitle.size.x) + 2.0F * kTitlePadding_px * s,
                      title.size.y + gap + subtitle.size.y + 1.4F * kTitlePadding_px * s};
  if (!corner_) corner_ = title_corner(size, place, keep_clear);
  const Vec2f upper_left = place_in(*corner_, size, place);
  const ImVec2 low(upper_left.x, upper_left.y);
  const ImVec2 high(low.x + size.x, low.y + size.y);
  const OverlayColors& colors = overlay_colors(theme);
  ImDrawList* list = ImGui::GetBackgroundDrawList();  // below menus, tooltips and the card of keys
  list->AddRectFilled(low, high, faded(colors.ground, 0.82F * opacity_now), 3.0F * s);
  list->AddRectFilled(low, ImVec2(low.x + 4.0F * s, high.y), faded(colors.accent, opacity_now));
  const ImVec2 at(low.x + kTitlePadding_px * s + 2.0F * s, low.y + 0.7F * kTitlePadding_px * s);
  title.paint(at, faded(colors.text, opacity_now), room);
  subtitle.paint(ImVec2(at.x, at.y + title.size.y + gap), faded(colors.text, 0.8F * opacity_now), room);
  return {low.x, low.y, high.x, high.y};
}

}  // namespace pf
