#include "view/scene_marks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "scene/derive.hpp"
#include "view/aim.hpp"
#include "view/magnifier.hpp"
#include "view/overlay_paint.hpp"
#include "view/profile_strip.hpp"

namespace pf {
namespace {

constexpr float kTop_px = 10.0F;  // layout pixels

constexpr double kMphPerMps = 3600.0 / 1609.344;  // miles of 1609.344 m
constexpr double kRpmPerRadps = 30.0 / kPi;

ImVec2 on_screen(Vec2d world_m, const ScenePlace& scene) {
  return on_screen(world_m, scene.camera, scene.height_px);
}

PxRect free_rect(const ScenePlace& scene) {
  const auto& [left, width, bottom, s] = scene.place;
  return {left, 0.0F, left + width, bottom};
}

// A ball there with some room around it.
PxRect rect_of_ball(double radius_m, ImVec2 at, const Camera& camera, float scale) {
  const auto ball_px = static_cast<float>(radius_m / camera.metres_per_px);
  return square_around(at.x, at.y, std::max(ball_px, 3.0F) + 14.0F * scale);
}

PxRect ball_rect(const FrameView& frame, const ScenePlace& scene) {
  return rect_of_ball(frame.physics->ball.radius_m, on_screen(frame.ball.position_m, scene), scene.camera,
                      scene.place.scale);
}

// Points on the screen of all paths, ghosts included.
std::vector<Vec2f> path_points(const FrameView& frame, const ScenePlace& scene) {
  std::vector<Vec2f> points;
  const auto add = [&](const std::vector<Vec2f>& points_m) {
    for (const Vec2f& point : points_m) {
      const ImVec2 at = on_screen(to_double(point), scene);
      points.push_back({at.x, at.y});
    }
  };
  if (frame.flight_record != nullptr) add(frame.flight_record->points_m);
  if (frame.old_flights != nullptr)
    for (const FlightRecord& old : *frame.old_flights) add(old.points_m);
  if (frame.ghosts != nullptr)
    for (const Ghost& ghost : *frame.ghosts) add(ghost.points_m);
  return points;
}

// Eight layout pixels per m/s, as long as the picture allows.
void show_arrow(Vec2d velocity_mps, ImVec2 from, const ScenePlace& scene) {
  const double speed_mps = length(velocity_mps);
  if (speed_mps == 0.0) return;
  const float s = scene.place.scale;
  const float length = std::min(8.0F * s * static_cast<float>(speed_mps), 0.7F * scene.place.width_px);
  const ImVec2 along(static_cast<float>(velocity_mps.x / speed_mps),
                     -static_cast<float>(velocity_mps.y / speed_mps));
  const float head = 12.0F * s;
  const ImVec2 to(from.x + along.x * length, from.y + along.y * length);
  const ImVec2 neck(to.x - along.x * head, to.y - along.y * head);
  const ImU32 color = overlay_colors(scene.look.theme).accent;
  ImDrawList* list = ImGui::GetForegroundDrawList();
  list->AddLine(from, neck, color, 3.0F * s);
  list->AddTriangleFilled(to, ImVec2(neck.x - along.y * 0.5F * head, neck.y + along.x * 0.5F * head),
                          ImVec2(neck.x + along.y * 0.5F * head, neck.y - along.x * 0.5F * head), color);
}

// An arc that grows by a turn per 200 rad/s, counter-clockwise for positive spin (the screen's y is down).
void show_spin(double spin_radps, ImVec2 center, float radius_px, const ScenePlace& scene) {
  ImDrawList* list = ImGui::GetForegroundDrawList();
  const auto turn = static_cast<float>(std::clamp(spin_radps / 200.0, -1.0, 1.0) * 2.0 * kPi);
  list->PathArcTo(center, radius_px, 0.0F, -turn, 48);
  list->PathStroke(overlay_colors(scene.look.theme).text, 0, 2.5F * scene.place.scale);
}

void show_figures(const BallLaunch& launch, ImVec2 at, const ScenePlace& scene) {
  const auto& [left, width, bottom, s] = scene.place;
  const OverlayColors& colors = overlay_colors(scene.look.theme);
  const double speed_mps = length(launch.velocity_mps);
  const std::string speed = fmt::format("{:.1f} m/s   {:.0f} mph", speed_mps, kMphPerMps * speed_mps);
  const std::string spin = fmt::format("{:+.0f} rad/s   {:+.0f} rpm   (Shift: spin)", launch.spin_radps,
                                       kRpmPerRadps * launch.spin_radps);
  const float box_px = std::max(text_width(speed, 1.25F), text_width(spin)) + 20.0F * s;
  const float line_px = 24.0F * s;
  at.x = std::max(std::min(at.x, left + width - box_px - 6.0F * s), left + 6.0F * s);
  at.y = std::max(std::min(at.y, bottom - 2.2F * line_px - 6.0F * s), 6.0F * s);
  ImDrawList* list = ImGui::GetForegroundDrawList();
  list->AddRectFilled(at, ImVec2(at.x + box_px, at.y + 2.2F * line_px), colors.ground, 5.0F * s);
  list->AddText(ImGui::GetFont(), 1.25F * ImGui::GetFontSize(), ImVec2(at.x + 10.0F * s, at.y + 5.0F * s),
                colors.accent, speed.c_str());
  list->AddText(ImVec2(at.x + 10.0F * s, at.y + 5.0F * s + 1.1F * line_px), colors.text, spin.c_str());
}

// Notices below each other, centred at the top of a place.
class Chips {
 public:
  using Rectangles = std::map<std::string, std::array<float, 4>>;

  Chips(const OverlayPlace& place, float top, const OverlayColors& colors, Rectangles& rectangles)
      : place_(place), y_(top), colors_(colors), rectangles_(rectangles) {}

  // Wrapped, because a message ends with its remedy. dot: red, before the text.
  void show(const char* name, const std::string& what, ImU32 edge, bool dot = false) {
    if (what.empty()) return;
    const float s = place_.scale;
    const float beside = (24.0F + (dot ? kDot_px : 0.0F)) * s;
    const float room = std::max(place_.width_px - beside - 16.0F * s, 8.0F * ImGui::GetFontSize());
    const ImVec2 text = ImGui::CalcTextSize(what.c_str(), nullptr, false, room);
    const float height = text.y + 12.0F * s;
    const float left = place_.left_px + std::max(0.5F * (place_.width_px - text.x - beside), 4.0F * s);
    // With very large text over a legend rather than below the picture.
    const float top = std::max(std::min(y_, place_.bottom_px - height - 4.0F * s), 0.0F);
    const ImVec2 low(left, top);
    const ImVec2 high(left + text.x + beside, top + height);
    ImDrawList* list = ImGui::GetBackgroundDrawList();  // below menus, tooltips and the card of keys
    list->AddRectFilled(low, high, colors_.ground, 13.0F * s);
    list->AddRect(low, high, edge, 13.0F * s);
    if (dot) list->AddCircleFilled(ImVec2(left + 15.0F * s, top + 0.5F * height), 5.0F * s, kRed);
    list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), ImVec2(high.x - 12.0F * s - text.x, top + 6.0F * s),
                  colors_.text, what.c_str(), nullptr, room);
    rectangles_[name] = {low.x, low.y, high.x, high.y};
    y_ = high.y + 6.0F * s;
  }

 private:
  static constexpr float kDot_px = 16.0F;  // with its gap
  static constexpr ImU32 kRed = IM_COL32(232, 52, 52, 255);

  const OverlayPlace& place_;
  float y_;
  const OverlayColors& colors_;
  Rectangles& rectangles_;
};

void show_notices(const FrameView& frame, const WindowNotices& window, const OverlayColors& colors,
                  Chips chips) {
  chips.show("Film notice", window.film, colors.edge, true);
  if (frame.paused) {
    chips.show("Pause notice", "Paused. Space: resume, S: one frame", colors.accent);
  } else if (frame.flight == Flight::landed) {
    chips.show(
        "Flight notice",
        frame.waits ? "The ball has left: M next method, L launch again" : "The ball has left the court",
        colors.accent);
  }
  chips.show("Success notice", frame.notice, colors.accent);
  chips.show("News notice", window.news, colors.accent);
  chips.show("Key notice", window.keys, colors.accent);
  chips.show("Failure notice", frame.message, colors.warning);
}

}  // namespace

void SceneMarks::show(const FrameView& frame, const ScenePlace& all, const WindowNotices& notices) {
  rectangles_.clear();
  if (frame.profile != nullptr) rectangles_["profile"] = show_profile_strip(frame, all);
  ScenePlace scene = all;
  scene.place = above_profile_strip(all.place, frame);
  float y = kTop_px * scene.place.scale + notices.below_px;
  OverlayPlace beside = scene.place;
  if (FlightLegend::is_shown(frame, scene.look)) {
    const ViewRegion legend = show_legend(frame, scene);
    // Notices stand beside the legend, or below one that is too wide.
    const bool is_at_top = legend.bottom_px + legend.height_px > scene.height_px - 1.0;
    if (is_at_top && legend.width_px < 0.6 * scene.place.width_px) {
      beside.width_px -= static_cast<float>(legend.width_px);
      const bool is_at_left = legend.left_px < scene.place.left_px + 1.0F;
      if (is_at_left) beside.left_px += static_cast<float>(legend.width_px);
    } else if (is_at_top) {
      y += static_cast<float>(legend.height_px);
    }
  }
  const OverlayColors& colors = overlay_colors(scene.look.theme);
  show_notices(frame, notices, colors, Chips(beside, y, colors, rectangles_));
  show_magnifier(frame, scene);
  if (FlightLegend::is_shown(frame, scene.look)) show_numbers(frame, scene);
}

std::vector<PxRect> SceneMarks::rectangles() const {
  std::vector<PxRect> all;
  for (const auto& [name, r] : rectangles_) all.push_back({r[0], r[1], r[2], r[3]});
  return all;
}

void SceneMarks::show_magnifier(const FrameView& frame, const ScenePlace& scene) {
  const std::optional<PxRect> before = magnifier_;
  magnifier_.reset();
  if (scene.magnifier_px <= 0.0F) return;
  const float s = scene.place.scale;
  InsetRequest request = {free_rect(scene), scene.magnifier_px, 10.0F * s, rectangles(), {}, before};
  request.keep_clear.push_back(ball_rect(frame, scene));
  if (scene.title.width() > 0.0F) request.keep_clear.push_back(scene.title);
  if (before) magnifier_ = place_inset(request);
  if (!before || magnifier_ != before) {
    request.path_px = path_points(frame, scene);
    magnifier_ = place_inset(request);
  }
  if (!magnifier_) return;
  const auto& [x0, y0, x1, y1] = *magnifier_;
  rectangles_["Magnifier square"] = {x0, y0, x1, y1};
  paint_magnifier_frame(
      *magnifier_,
      {scene.camera.metres_per_px / scene.magnifier_metres_per_px, scene.magnifier_metres_per_px},
      scene.look.theme, s);
}

void SceneMarks::note(ControlMap& controls) const {
  for (const auto& [name, rectangle] : rectangles_) controls.note(name, rectangle);
}

ViewRegion SceneMarks::region_for_world(const FrameView& frame, const Look& look, const ViewRegion& all,
                                        float scale) const {
  const ViewRegion free = above_profile_strip(all, frame, scale);
  LegendSize size = legend_.size(frame, look, scale);
  if (size.height_px == 0.0) return free;
  // Very large text lets the scene shine through.
  constexpr double kMaxShare = 0.4;
  size.height_px = std::min(size.height_px, kMaxShare * free.height_px);
  size.width_px = std::min(size.width_px, free.width_px);
  return region_beside(free, size, frame.physics->world, scale);
}

// Returns the rectangle that it takes.
ViewRegion SceneMarks::show_legend(const FrameView& frame, const ScenePlace& scene) {
  const float scale = scene.place.scale;
  legend_.write(frame, scene.look, scale, scene.place.width_px);
  const ViewRegion free = {scene.place.left_px, scene.height_px - scene.place.bottom_px, scene.place.width_px,
                           scene.place.bottom_px};
  const ViewRegion at = place_legend(free, legend_.size(frame, scene.look, scale),
                                     region_of_world(scene.camera, frame.physics->world));
  const auto top = static_cast<float>(scene.height_px - at.bottom_px - at.height_px);
  const auto left = static_cast<float>(at.left_px);
  const PxRect rect = {left, top, left + static_cast<float>(at.width_px),
                       top + static_cast<float>(at.height_px)};
  const int first_vertex = ImGui::GetBackgroundDrawList()->VtxBuffer.Size;
  const PxRect painted = legend_.paint(ImVec2(left, top), frame, scene.look, scale);
  const bool ball_flies = frame.flight == Flight::flying && !frame.paused;
  fade_legend(ball_flies && overlap_px2(painted, ball_rect(frame, scene)) > 0.0F, first_vertex);
  rectangles_["Legend"] = {rect.x0, rect.y0, rect.x1, rect.y1};
  return at;
}

PxRect SceneMarks::start_rect(const FrameView& frame, const Camera& camera, float height_px, float scale) {
  if (!frame.physics->ball.exists) return {};
  const Vec2d start_m = initial_ball(*frame.settings).position_m;
  return rect_of_ball(frame.physics->ball.radius_m, pf::on_screen(start_m, camera, height_px), camera, scale);
}

// A legend over a ball that flies lets it shine through; else it is there to be read. first_vertex: of the
// legend, in ImGui's list.
void SceneMarks::fade_legend(bool covers_ball, int first_vertex) {
  constexpr float kFaded = 0.25F;
  constexpr float kPerSecond = 6.0F;
  const float wanted = covers_ball ? kFaded : 1.0F;
  const float step = kPerSecond * ImGui::GetIO().DeltaTime;
  legend_alpha_ = std::clamp(wanted, legend_alpha_ - step, legend_alpha_ + step);
  ImVector<ImDrawVert>& vertices = ImGui::GetBackgroundDrawList()->VtxBuffer;
  for (int i = first_vertex; i < vertices.Size && legend_alpha_ < 1.0F; ++i) {
    const auto alpha = static_cast<ImU32>(legend_alpha_ * static_cast<float>(vertices[i].col >> 24U));
    vertices[i].col = (vertices[i].col & 0x00FFFFFFU) | (alpha << 24U);
  }
}

// At the newest point of each earlier path, inside the scene, clear of each other and of all other marks.
void SceneMarks::show_numbers(const FrameView& frame, const ScenePlace& scene) {
  const float s = scene.place.scale;
  const float height = ImGui::GetFontSize();
  std::vector<PxRect> wanted;
  std::vector<const FlightRecord*> flights;
  for (const FlightRecord& flight : *frame.old_flights) {
    if (flight.points_m.empty()) continue;
    const ImVec2 end = on_screen(to_double(flight.points_m.back()), scene);
    const ImVec2 at(end.x - 6.0F * s, end.y - 6.0F * s - height);
    wanted.push_back({at.x, at.y, at.x + text_width(fmt::format("{}", flight.number)), at.y + height});
    flights.push_back(&flight);
  }
  const std::vector<PxRect> places = place_labels(wanted, grown(free_rect(scene), -4.0F * s), rectangles());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::string number = fmt::format("{}", flights[i]->number);
    const auto& [x0, y0, x1, y1] = places[i];
    ImGui::GetBackgroundDrawList()->AddText(
        ImVec2(x0, y0), packed(flight_color(scene.look.theme, *flights[i])), number.c_str());
    rectangles_["Number " + number] = {x0, y0, x1, y1};
  }
}

void SceneMarks::show_ring(Vec2d ball_m, double radius_px, const std::string& hint, const ScenePlace& scene) {
  const float s = scene.place.scale;
  const auto radius = static_cast<float>(radius_px);
  const OverlayColors& colors = overlay_colors(scene.look.theme);
  const ImVec2 ball = on_screen(ball_m, scene);
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  list->AddCircle(ball, radius, colors.accent, 0, 2.0F * s);
  if (hint.empty()) return;
  const float gap = radius + 10.0F * s, hint_px = text_width(hint);
  const bool is_left = ball.x + gap + hint_px > scene.place.left_px + scene.place.width_px - 6.0F * s;
  const ImVec2 at(is_left ? ball.x - gap - hint_px : ball.x + gap, ball.y - 0.5F * ImGui::GetFontSize());
  const ImVec2 end(at.x + hint_px + 6.0F * s, at.y + ImGui::GetFontSize() + 3.0F * s);
  list->AddRectFilled(ImVec2(at.x - 6.0F * s, at.y - 3.0F * s), end, colors.ground, 4.0F * s);
  list->AddText(at, colors.text, hint.c_str());
}

void SceneMarks::show_aim(const BallLaunch& launch, Vec2d start_m, double ball_radius_m,
                          const ScenePlace& scene) {
  const auto& [left, width, bottom, s] = scene.place;
  const ImVec2 from = on_screen(start_m, scene);
  ImDrawList* list = ImGui::GetForegroundDrawList();
  list->PushClipRect(ImVec2(left, 0.0F), ImVec2(left + width, bottom));  // not over panel and overlay
  show_arrow(launch.velocity_mps, from, scene);
  const auto radius = static_cast<float>(ring_radius_px(ball_radius_m / scene.camera.metres_per_px, s));
  show_spin(launch.spin_radps, from, radius, scene);
  const float offset = radius + 8.0F * s;
  show_figures(launch, ImVec2(from.x + offset, from.y + offset), scene);
  list->PopClipRect();
}

}  // namespace pf
