#include "view/magnifier.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "view/overlay_paint.hpp"

namespace pf {
namespace {

constexpr double kSmallBall_px = 12.0;       // layout pixels; a wider ball needs no magnifier
constexpr double kMagnifiedBallShare = 0.3;  // of the side, usually
constexpr double kMinNearer = 0.2, kMaxNearer = 12.0;
constexpr float kSide_px = 190.0F;      // layout pixels
constexpr float kMaxSideShare = 0.36F;  // of the free region
constexpr float kMinSide_px = 64.0F;    // layout pixels
constexpr double kMinParcel_px = 3.0;   // layout pixels

}  // namespace

void MagnifierZoom::change(double factor) {
  nearer_ = std::clamp(std::max(nearer_, min_nearer_) * factor, kMinNearer, kMaxNearer);
}

double MagnifierZoom::metres_per_px(double ball_radius_m, double side_px, double around_metres_per_px) {
  const double usual = 2.0 * ball_radius_m / (kMagnifiedBallShare * side_px);
  min_nearer_ = usual / around_metres_per_px;
  return std::min(usual / nearer_, around_metres_per_px);
}

bool Magnifier::is_wanted(MagnifierMode mode, const FrameView& frame, const Camera& camera, float scale,
                          bool with_marks) {
  if (!frame.physics->ball.exists || mode == MagnifierMode::off) return false;
  const double ball_px = 2.0 * frame.physics->ball.radius_m / camera.metres_per_px;
  return mode == MagnifierMode::on || (with_marks && ball_px < kSmallBall_px * scale);
}

float Magnifier::side_px(float free_width_px, float free_height_px, float scale) {
  const float side = std::min(kSide_px * scale, kMaxSideShare * std::min(free_width_px, free_height_px));
  return side < kMinSide_px * scale ? 0.0F : std::floor(side);
}

void Magnifier::set_look(const Look& look) {
  renderer_.set_look(look);
  renderer_.set_parcel_size({true, kMinParcel_px});
}

Viewport Magnifier::viewport() const {
  return {canvas_.framebuffer(), canvas_.texture(), {side_px_, side_px_}, scale_};
}

void Magnifier::draw_air(const FrameView& frame, const ParcelBuffers& parcels, Vec2d ball_m,
                         const Camera& around, float side_px, float scale) {
  side_px_ = static_cast<int>(side_px);
  scale_ = scale;
  camera_.metres_per_px = zoom_.metres_per_px(frame.physics->ball.radius_m, side_px_, around.metres_per_px);
  camera_.center_m = ball_m;
  camera_.anchor_px = {0.5 * side_px_, 0.5 * side_px_};
  camera_.shows_images = true;
  canvas_.resize(side_px_, side_px_);
  renderer_.draw_air(frame, &parcels, camera_, viewport());
}

void Magnifier::draw_flight(const FrameView& frame) { renderer_.draw_flight(frame, camera_, viewport()); }

void Magnifier::copy(const PxRect& place, const Viewport& to) const {
  const int left = static_cast<int>(place.x0) - to.origin_px.x;
  const int bottom = to.whole_height() - static_cast<int>(place.y0) - side_px_ - to.origin_px.y;
  glBindFramebuffer(GL_FRAMEBUFFER, to.framebuffer);
  glBlitNamedFramebuffer(canvas_.framebuffer(), to.framebuffer, 0, 0, side_px_, side_px_, left, bottom,
                         left + side_px_, bottom + side_px_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

ScaleBar scale_bar(double max_length_m) {
  const double power = std::pow(10.0, std::floor(std::log10(max_length_m)));
  double length_m = power;
  for (const double factor : {2.0, 5.0}) {
    if (factor * power <= max_length_m * (1.0 + 1e-9)) length_m = factor * power;
  }
  if (length_m >= 0.999) return {length_m, fmt::format("{:g} m", length_m)};
  if (length_m >= 0.00999) return {length_m, fmt::format("{:g} cm", 100.0 * length_m)};
  if (length_m >= 0.000999) return {length_m, fmt::format("{:g} mm", 1e3 * length_m)};
  return {length_m, fmt::format("{:g} \xC2\xB5m", 1e6 * length_m)};
}

void paint_magnifier_frame(const PxRect& place, const MagnifierScale& scale, Theme theme, float ui_scale) {
  const OverlayColors& colors = overlay_colors(theme);
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float s = ui_scale;
  const ScaleBar bar = scale_bar(0.4 * place.width() * scale.metres_per_px);
  const auto bar_px = static_cast<float>(bar.length_m / scale.metres_per_px);
  const float line = ImGui::GetFontSize() + 4.0F * s;
  list->AddRect(ImVec2(place.x0 - 0.5F * s, place.y0 - 0.5F * s),
                ImVec2(place.x1 + 0.5F * s, place.y1 + 0.5F * s), colors.accent, 0.0F, 0, 1.5F * s);
  list->AddRectFilled(ImVec2(place.x0, place.y1 - line), ImVec2(place.x1, place.y1), colors.ground);
  const float y = place.y1 - line + 2.0F * s;
  const float bar_y = place.y1 - 0.5F * line;
  const float left = place.x0 + 7.0F * s;
  list->AddLine(ImVec2(left, bar_y), ImVec2(left + bar_px, bar_y), colors.text, 2.0F * s);
  for (const float x : {left, left + bar_px})
    list->AddLine(ImVec2(x, bar_y - 3.0F * s), ImVec2(x, bar_y + 3.0F * s), colors.text, 1.5F * s);
  list->AddText(ImVec2(left + bar_px + 6.0F * s, y), colors.text, bar.text.c_str());
  const bool is_large = scale.magnification >= 99.5;  // two digits would come with an exponent
  const std::string digits =
      is_large ? fmt::format("{:.0f}", scale.magnification) : fmt::format("{:.2g}", scale.magnification);
  const std::string times = digits + "\xC3\x97";
  const float bar_end = left + bar_px + 12.0F * s + text_width(bar.text);
  if (bar_end + text_width(times) > place.x1 - 6.0F * s) return;  // the bar says enough
  list->AddText(ImVec2(place.x1 - 6.0F * s - text_width(times), y), colors.accent, times.c_str());
}

}  // namespace pf
