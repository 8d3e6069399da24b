#include "view/profile_strip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/round_up.hpp"
#include "view/overlay_paint.hpp"

namespace pf {
namespace {

constexpr float kHeight_px = 132.0F, kText_px = 20.0F, kAxis_px = 18.0F, kStripMargin_px = 6.0F;
constexpr float kMinTickSpacing_px = 90.0F;

// A quantity over the bins, and its scale.
struct Curve {
  ImU32 color;
  std::string name;  // with the top of its scale
  double low, high;  // of the plot
  std::vector<double> values;
};

double largest(const std::vector<ProfileRow>& rows, double ProfileRow::*member) {
  double top = 0.0;
  for (const ProfileRow& row : rows) {
    if (std::isfinite(row.*member)) top = std::max(top, std::fabs(row.*member));
  }
  return top;
}

Curve make_curve(const std::vector<ProfileRow>& rows, double ProfileRow::*member, ImU32 color,
                 bool has_sign) {
  const double top = round_up(largest(rows, member));
  Curve curve{color, "", has_sign ? -top : 0.0, top, {}};
  for (const ProfileRow& row : rows) curve.values.push_back(row.*member);
  return curve;
}

// Okabe and Ito (2008), bright enough for the dark theme and dark enough for the light one.
std::vector<Curve> curves_of(const std::vector<ProfileRow>& rows, Theme theme) {
  const bool light = theme == Theme::light;
  const ImU32 blue = light ? IM_COL32(0, 114, 178, 255) : IM_COL32(86, 180, 233, 255);
  const ImU32 orange = light ? IM_COL32(170, 75, 0, 255) : IM_COL32(230, 159, 0, 255);
  const ImU32 green = light ? IM_COL32(0, 120, 88, 255) : IM_COL32(0, 190, 140, 255);
  std::vector<Curve> curves = {make_curve(rows, &ProfileRow::area_fraction, blue, false),
                               make_curve(rows, &ProfileRow::velocity_mps, orange, true),
                               make_curve(rows, &ProfileRow::speed_mps, green, false)};
  curves[0].name = fmt::format("area fraction 0 to {:g}", curves[0].high);
  curves[1].name = fmt::format("mean velocity {:g} to {:g} m/s", curves[1].low, curves[1].high);
  curves[2].name = fmt::format("thermal speed 0 to {:g} m/s", curves[2].high);
  return curves;
}

struct Box {
  float left, top, right, bottom;
};

float strip_height_px(float room_px, float scale) { return std::min(kHeight_px * scale, 0.5F * room_px); }

Box box_of(const ScenePlace& scene) {
  const OverlayPlace& place = scene.place;
  const float margin = kStripMargin_px * place.scale;
  return {place.left_px + margin, place.bottom_px - strip_height_px(place.bottom_px, place.scale) + margin,
          place.left_px + place.width_px - margin, place.bottom_px - margin};
}

float x_of(const Camera& camera, double x_m) {
  return static_cast<float>(camera.anchor_px.x + (x_m - camera.center_m.x) / camera.metres_per_px);
}

// side: -1 mirrors a profile by distance to the left of the middle. Empty bins leave a gap.
void paint_curve(const Curve& curve, const std::vector<ProfileRow>& rows, const Camera& camera,
                 const Box& plot, double side) {
  ImDrawList* list = ImGui::GetWindowDrawList();
  const float thickness = std::max(1.5F, 0.014F * (plot.bottom - plot.top));
  for (std::size_t k = 1; k < rows.size(); ++k) {
    if (!std::isfinite(curve.values[k - 1]) || !std::isfinite(curve.values[k])) continue;
    const auto point = [&](std::size_t at) {
      const double share = (curve.values[at] - curve.low) / (curve.high - curve.low);
      return ImVec2(x_of(camera, side * rows[at].position_m),
                    plot.bottom - static_cast<float>(share) * (plot.bottom - plot.top));
    };
    list->AddLine(point(k - 1), point(k), curve.color, thickness);
  }
}

// Side by side, smaller where the strip is too narrow for all of them.
void write_names(const std::vector<Curve>& curves, const Box& box, float scale) {
  const float before = 8.0F * scale, between = 22.0F * scale;
  float needed = 2.0F * before - between;
  for (const Curve& curve : curves) needed += text_width(curve.name) + between;
  const float size = std::min(1.0F, (box.right - box.left) / needed);
  float x = box.left + size * before;
  const float y = box.top + 3.0F * scale;
  for (const Curve& curve : curves) {
    ImGui::GetWindowDrawList()->AddText(ImGui::GetFont(), size * ImGui::GetFontSize(), ImVec2(x, y),
                                        curve.color, curve.name.c_str());
    x += size * (text_width(curve.name) + between);
  }
}

// Metres below the plot, with a line at each: x, or the distance from the middle.
void paint_axis(const ScenePlace& scene, ProfileAxis axis, const Box& plot) {
  const Camera& camera = scene.camera;
  const OverlayColors& colors = overlay_colors(scene.look.theme);
  ImDrawList* list = ImGui::GetWindowDrawList();
  const double step_m = round_up(kMinTickSpacing_px * scene.place.scale * camera.metres_per_px);
  const double left_m = camera.center_m.x + (plot.left - camera.anchor_px.x) * camera.metres_per_px;
  for (double tick = std::ceil(left_m / step_m);; ++tick) {
    const float x = x_of(camera, tick * step_m);
    const double metres = axis == ProfileAxis::radius ? std::fabs(tick * step_m) : tick * step_m;
    const std::string label = fmt::format("{:.6g} m", metres + 0.0);
    const float half_width = 0.5F * text_width(label);
    if (x > plot.right) break;
    list->AddLine(ImVec2(x, plot.top), ImVec2(x, plot.bottom), colors.edge, scene.place.scale);
    if (x - half_width >= plot.left && x + half_width <= plot.right)
      list->AddText(ImVec2(x - half_width, plot.bottom), colors.text, label.c_str());
  }
}

void paint_strip(const FrameView& frame, const ScenePlace& scene, const Box& box) {
  const float scale = scene.place.scale;
  const OverlayColors& colors = overlay_colors(scene.look.theme);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(ImVec2(box.left, box.top), ImVec2(box.right, box.bottom), colors.ground, 4.0F * scale);
  const Box plot{box.left, box.top + kText_px * scale, box.right, box.bottom - kAxis_px * scale};
  const float middle = 0.5F * (plot.top + plot.bottom);
  list->AddLine(ImVec2(plot.left, middle), ImVec2(plot.right, middle), colors.edge, scale);
  paint_axis(scene, frame.profile->shape.axis, plot);
  const std::vector<ProfileRow> rows = rows_of(*frame.profile, frame.physics->parcels);
  const std::vector<Curve> curves = curves_of(rows, scene.look.theme);
  write_names(curves, box, scale);
  ImGui::PushClipRect(ImVec2(plot.left, plot.top), ImVec2(plot.right, plot.bottom), true);
  for (const Curve& curve : curves) {
    paint_curve(curve, rows, scene.camera, plot, 1.0);
    if (frame.profile->shape.axis == ProfileAxis::radius) paint_curve(curve, rows, scene.camera, plot, -1.0);
  }
  ImGui::PopClipRect();
}

}  // namespace

ViewRegion above_profile_strip(const ViewRegion& all, const FrameView& frame, float scale) {
  if (frame.profile == nullptr) return all;
  const double strip_px = strip_height_px(static_cast<float>(all.height_px), scale);
  return {all.left_px, all.bottom_px + strip_px, all.width_px, all.height_px - strip_px};
}

OverlayPlace above_profile_strip(const OverlayPlace& all, const FrameView& frame) {
  OverlayPlace above = all;
  if (frame.profile != nullptr) above.bottom_px -= strip_height_px(all.bottom_px, all.scale);
  return above;
}

std::array<float, 4> show_profile_strip(const FrameView& frame, const ScenePlace& scene) {
  if (frame.profile == nullptr) return {};
  const Box box = box_of(scene);
  ImGui::SetNextWindowPos(ImVec2(box.left, box.top));
  ImGui::SetNextWindowSize(ImVec2(box.right - box.left, box.bottom - box.top));
  constexpr ImGuiWindowFlags kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs |
                                      ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoSavedSettings |
                                      ImGuiWindowFlags_NoFocusOnAppearing |
                                      ImGuiWindowFlags_NoBringToFrontOnFocus;
  ImGui::Begin("profile", nullptr, kFlags);
  paint_strip(frame, scene, box);
  ImGui::End();
  return {box.left, box.top, box.right, box.bottom};
}

}  // namespace pf
