#include "view/scene_marks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace pf {
namespace {

constexpr int kFramesPerText = 6;
constexpr float kTop_px = 10.0F;  // layout pixels, as those below
constexpr float kRow_px = 17.0F;
constexpr float kPad_px = 10.0F;
constexpr std::size_t kNumColumns = 7;
constexpr std::array<std::string FlightRow::*, kNumColumns> kCells = {
    &FlightRow::number, &FlightRow::method, &FlightRow::speed, &FlightRow::spin,
    &FlightRow::apart,  &FlightRow::energy, &FlightRow::cost};
constexpr std::array<const char*, kNumColumns> kHeads = {
    "", "method", "m/s", "rad/s", "apart: end, most", "energy drift", "cost"};

constexpr double kMphPerMps = 3600.0 / 1609.344;  // miles of 1609.344 m
constexpr double kRpmPerRadps = 30.0 / kPi;

std::string air_name(const FlightRecord& flight) {
  switch (flight.air) {
    case Air::vacuum:
      return "vacuum";
    case Air::drag:
      return "drag, closed form";
    default:
      return std::get<Choice>(find_field("run.method", "legend").member)
          .names[static_cast<std::size_t>(flight.method)];
  }
}

std::string step_text(double dt_s) {
  return dt_s >= 1e-3 ? fmt::format("{:.3g} ms", 1e3 * dt_s) : fmt::format("{:.3g} \xC2\xB5s", 1e6 * dt_s);
}

FlightRow plain_row(const FlightRecord& flight, std::size_t age) {
  FlightRow row;
  row.number = age == 0 ? "now" : fmt::format("{}", age);
  row.method = air_name(flight);
  if (flight.dt_s > 0.0) row.method += ", " + step_text(flight.dt_s);
  if (flight.disturbed) row.method += ", changed in flight";
  if (!flight.fresh_air) row.method += ", used air";
  row.speed = fmt::format("{:.1f}", flight.speed_mps);
  row.spin = fmt::format("{:.0f}", flight.spin_radps);
  return row;
}

std::string length_text(double m) {
  if (m >= 1.0) return fmt::format("{:.2f} m", m);
  return m >= 1e-4 ? fmt::format("{:.1f} mm", 1e3 * m) : fmt::format("{:.1f} \xC2\xB5m", 1e6 * m);
}

void compare_row(const FlightRecord& flight, const FlightRecord* first, bool ended, FlightRow& row) {
  if (first == &flight) {
    row.apart = "-";
  } else if (const auto distance = distance_between(*first, flight)) {
    row.apart = length_text(distance->at_end_m) + ", " + length_text(distance->largest_m);
  }
  const auto drift = ended ? flight.energy_drift() : std::nullopt;
  row.energy = drift ? fmt::format("{:+.3f} %", 100.0 * *drift) : (ended ? "?" : "...");
  row.cost = fmt::format("{:.1f} ms", flight.compute_ms);
}

ImVec2 on_screen(Vec2d world_m, const Camera& camera, float height_px) {
  const Vec2d px = (world_m - camera.center_m) * (1.0 / camera.metres_per_px) + camera.anchor_px;
  return {static_cast<float>(px.x), height_px - static_cast<float>(px.y)};
}

// A rounded notice, centred at the top; returns where the next one may stand.
float show_chip(const std::string& what, ImU32 edge, float y, const OverlayPlace& place,
                const OverlayColors& colors) {
  const float width = text_width(what) + 24.0F * place.scale;
  const float height = 26.0F * place.scale;
  const float left = place.left_px + std::max(0.5F * (place.width_px - width), 4.0F);
  ImDrawList* list = ImGui::GetForegroundDrawList();
  list->AddRectFilled(ImVec2(left, y), ImVec2(left + width, y + height), colors.ground, 0.5F * height);
  list->AddRect(ImVec2(left, y), ImVec2(left + width, y + height), edge, 0.5F * height);
  list->AddText(ImVec2(left + 12.0F * place.scale, y + 0.5F * (height - ImGui::GetFontSize())), colors.text,
                what.c_str());
  return y + height + 6.0F * place.scale;
}

void show_notices(const FrameView& frame, float y, const OverlayPlace& place, const OverlayColors& colors) {
  const float width = place.width_px - 40.0F * place.scale;
  if (frame.paused) {
    y = show_chip("Paused: space runs on, S steps", colors.accent, y, place, colors);
  } else if (frame.flight == Flight::landed) {
    y = show_chip(
        frame.waits ? "The ball has left: M next method, L launch again" : "The ball has left the court",
        colors.accent, y, place, colors);
  }
  if (!frame.notice.empty()) y = show_chip(fitting(frame.notice, width), colors.accent, y, place, colors);
  if (!frame.message.empty()) show_chip(fitting(frame.message, width), colors.warning, y, place, colors);
}

std::string ghost_name(Air air) { return air == Air::vacuum ? "vacuum" : "drag, closed form"; }

// A short piece of the line that the row is about.
void paint_sample(ImDrawList* list, float x, float y, float width, ImU32 color, float dash_px, float scale) {
  if (dash_px <= 0.0F) {
    list->AddLine(ImVec2(x, y), ImVec2(x + width, y), color, 2.5F * scale);
    return;
  }
  for (float at = 0.0F; at < width; at += dash_px)
    list->AddLine(ImVec2(x + at, y), ImVec2(x + std::min(at + 0.6F * dash_px, width), y), color,
                  1.5F * scale);
}

}  // namespace

std::vector<FlightRow> flight_rows(const FrameView& frame) {
  std::vector<const FlightRecord*> flights = {frame.flight_record};
  for (const FlightRecord& old : *frame.old_flights) flights.push_back(&old);
  const FlightRecord* first = frame.flight_record;  // the oldest of the present launch
  for (const FlightRecord* flight : flights) {
    if (flight->launch == frame.flight_record->launch) first = flight;
  }
  std::vector<FlightRow> rows;
  for (std::size_t age = 0; age < flights.size(); ++age) {
    const FlightRecord& flight = *flights[age];
    rows.push_back(plain_row(flight, age));
    if (first == frame.flight_record || flight.launch != first->launch) continue;
    compare_row(flight, first, age > 0 || frame.flight == Flight::landed, rows.back());
  }
  return rows;
}

void SceneMarks::show(const FrameView& frame, const Camera& camera, const OverlayPlace& place,
                      float height_px, const Look& look) {
  const OverlayColors& colors = overlay_colors(look.theme);
  float y = kTop_px * place.scale;
  OverlayPlace beside = place;
  if (look.paths && frame.physics->ball.exists) {
    // Notices stand beside the legend, or below one that is too wide.
    const ImVec2 legend = show_flights(frame, place, look);
    if (legend.x < 0.6F * place.width_px)
      beside.width_px -= legend.x;
    else
      y += legend.y;
    show_numbers(frame, camera, place, height_px, look);
  }
  show_notices(frame, y, beside, colors);
}

float SceneMarks::reserved_px(const FrameView& frame, const Look& look, float scale, float height_px) {
  if (!look.paths || !frame.physics->ball.exists) return 0.0F;
  constexpr float kNumRows = 4.0F;  // with the heads
  constexpr float kMaxShare = 0.2F;
  return std::min((kTop_px + kNumRows * kRow_px + 1.4F * kPad_px) * scale, kMaxShare * height_px);
}

void SceneMarks::write_rows(const FrameView& frame) {
  if (written_flight_ == frame.num_flights && ++frames_since_ < kFramesPerText && !frame.paused) return;
  rows_ = flight_rows(frame);
  written_flight_ = frame.num_flights;
  frames_since_ = 0;
}

// Returns the room that it takes.
ImVec2 SceneMarks::show_flights(const FrameView& frame, const OverlayPlace& place, const Look& look) {
  write_rows(frame);
  const OverlayColors& colors = overlay_colors(look.theme);
  const float s = place.scale;
  constexpr float kSize = 0.92F;
  const float gap = 14.0F * s;
  const float sample = 24.0F * s;
  std::array<float, kNumColumns> widths{};
  float width = sample;
  for (std::size_t c = 0; c < kNumColumns; ++c) {
    for (const FlightRow& row : rows_) widths[c] = std::max(widths[c], text_width(row.*kCells[c], kSize));
    if (widths[c] == 0.0F) continue;
    widths[c] = std::max(widths[c], text_width(kHeads[c], kSize));
    width += widths[c] + gap;
  }
  const std::size_t num_ghosts = look.ghosts && frame.ghosts != nullptr ? frame.ghosts->size() : 0;
  const float row_px = kRow_px * s;
  const float pad = kPad_px * s;
  const float height = row_px * static_cast<float>(1 + rows_.size() + num_ghosts) + 1.4F * pad;
  const float left = place.left_px + std::max(place.width_px - width - 2.0F * pad - 10.0F * s, 4.0F * s);
  float y = kTop_px * s;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  list->AddRectFilled(ImVec2(left, y), ImVec2(left + width + 2.0F * pad, y + height), colors.ground,
                      5.0F * s);
  const auto write = [&](float x, float at, ImU32 color, const std::string& what) {
    list->AddText(ImGui::GetFont(), kSize * ImGui::GetFontSize(), ImVec2(x, at), color, what.c_str());
  };
  y += 0.7F * pad;
  float x = left + pad + sample;
  for (std::size_t c = 0; c < kNumColumns; ++c) {
    if (widths[c] == 0.0F) continue;
    const bool to_the_right = c >= 2;
    x += gap;
    write(to_the_right ? x + widths[c] - text_width(kHeads[c], kSize) : x, y, colors.dim, kHeads[c]);
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const std::string& cell = rows_[r].*kCells[c];
      const float at = to_the_right ? x + widths[c] - text_width(cell, kSize) : x;
      write(at, y + row_px * static_cast<float>(r + 1), r == 0 ? colors.text : colors.dim, cell);
    }
    x += widths[c];
  }
  const auto middle = [&](std::size_t r) { return y + row_px * (static_cast<float>(r + 1) + 0.5F); };
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Rgb color = r == 0 ? theme_colors(look.theme).path : old_flight_color(look.theme, r - 1);
    paint_sample(list, left + pad, middle(r), sample, packed(color), 0.0F, s);
  }
  for (std::size_t g = 0; g < num_ghosts; ++g) {
    const Air air = (*frame.ghosts)[g].air;
    const std::size_t r = rows_.size() + g;
    paint_sample(list, left + pad, middle(r), sample, packed(theme_colors(look.theme).ghost),
                 ghost_dash_px(air) * s, s);
    write(left + pad + sample + gap, y + row_px * static_cast<float>(r + 1), colors.dim, ghost_name(air));
  }
  return {width + 2.0F * pad + 20.0F * s, height + 6.0F * s};
}

// At the newest point of each earlier path, inside the scene.
void SceneMarks::show_numbers(const FrameView& frame, const Camera& camera, const OverlayPlace& place,
                              float height_px, const Look& look) {
  const float s = place.scale;
  for (std::size_t i = 0; i < frame.old_flights->size(); ++i) {
    const FlightRecord& flight = (*frame.old_flights)[i];
    if (flight.points_m.empty()) continue;
    ImVec2 at = on_screen(to_double(flight.points_m.back()), camera, height_px);
    at.x = std::clamp(at.x - 6.0F * s, place.left_px + 4.0F * s, place.left_px + place.width_px - 16.0F * s);
    at.y = std::clamp(at.y - 20.0F * s, 4.0F * s, place.bottom_px - 20.0F * s);
    ImGui::GetBackgroundDrawList()->AddText(at, packed(old_flight_color(look.theme, i)),
                                            fmt::format("{}", i + 1).c_str());
  }
}

void SceneMarks::show_aim(const BallLaunch& launch, Vec2d start_m, double ball_radius_m, const Camera& camera,
                          const OverlayPlace& place, float height_px, const Look& look) {
  const OverlayColors& colors = overlay_colors(look.theme);
  const float s = place.scale;
  ImDrawList* list = ImGui::GetForegroundDrawList();
  const ImVec2 from = on_screen(start_m, camera, height_px);
  const double speed_mps = std::sqrt(dot(launch.velocity_mps, launch.velocity_mps));
  if (speed_mps > 0.0) {
    // Eight layout pixels per m/s, as long as the picture allows.
    const float length = std::min(8.0F * s * static_cast<float>(speed_mps), 0.7F * place.width_px);
    const ImVec2 along(static_cast<float>(launch.velocity_mps.x / speed_mps),
                       -static_cast<float>(launch.velocity_mps.y / speed_mps));
    const float head = 12.0F * s;
    const ImVec2 to(from.x + along.x * length, from.y + along.y * length);
    const ImVec2 neck(to.x - along.x * head, to.y - along.y * head);
    list->AddLine(from, neck, colors.accent, 3.0F * s);
    list->AddTriangleFilled(to, ImVec2(neck.x - along.y * 0.5F * head, neck.y + along.x * 0.5F * head),
                            ImVec2(neck.x + along.y * 0.5F * head, neck.y - along.x * 0.5F * head),
                            colors.accent);
  }
  const float radius =
      std::max(static_cast<float>(ball_radius_m / camera.metres_per_px), 4.0F * s) + 6.0F * s;
  // The arc grows by a turn per 200 rad/s, counter-clockwise for positive spin (the screen's y is down).
  const auto turn = static_cast<float>(std::clamp(launch.spin_radps / 200.0, -1.0, 1.0) * 2.0 * kPi);
  list->PathArcTo(from, radius, 0.0F, -turn, 48);
  list->PathStroke(colors.text, 0, 2.5F * s);
  const std::string lines[2] = {fmt::format("{:.1f} m/s   {:.0f} mph", speed_mps, kMphPerMps * speed_mps),
                                fmt::format("{:+.0f} rad/s   {:+.0f} rpm   (Shift: spin)", launch.spin_radps,
                                            kRpmPerRadps * launch.spin_radps)};
  const float width = std::max(text_width(lines[0], 1.25F), text_width(lines[1])) + 20.0F * s;
  const float line_px = 24.0F * s;
  ImVec2 at(from.x + radius + 8.0F * s, from.y + radius + 8.0F * s);
  at.x = std::clamp(at.x, place.left_px + 6.0F * s, place.left_px + place.width_px - width - 6.0F * s);
  at.y = std::clamp(at.y, 6.0F * s, place.bottom_px - 2.2F * line_px - 6.0F * s);
  list->AddRectFilled(at, ImVec2(at.x + width, at.y + 2.2F * line_px), colors.ground, 5.0F * s);
  list->AddText(ImGui::GetFont(), 1.25F * ImGui::GetFontSize(), ImVec2(at.x + 10.0F * s, at.y + 5.0F * s),
                colors.accent, lines[0].c_str());
  list->AddText(ImVec2(at.x + 10.0F * s, at.y + 5.0F * s + 1.1F * line_px), colors.text, lines[1].c_str());
}

}  // namespace pf
