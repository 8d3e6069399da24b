#include "view/overlay.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "view/color_map.hpp"

namespace pf {
namespace {

constexpr float kRow_px = 18.0F;
constexpr int kNumRows = 6;
constexpr float kPadding_px = 14.0F;
constexpr float kStatusWidth_px = 300.0F;
constexpr float kPhasesWidth_px = 306.0F;
constexpr float kLegendWidth_px = 150.0F;
constexpr float kGap_px = 26.0F;

constexpr ImU32 kGround = IM_COL32(11, 19, 25, 235);
constexpr ImU32 kEdge = IM_COL32(38, 56, 66, 255);
constexpr ImU32 kText = IM_COL32(226, 233, 234, 255);
constexpr ImU32 kDim = IM_COL32(139, 158, 165, 255);
constexpr ImU32 kAccent = IM_COL32(242, 212, 63, 255);

// In the order of Phase. Distinct in lightness as well as in hue (after Tol's bright and light schemes).
constexpr ImU32 kPhaseColors[kNumPhases] = {IM_COL32(68, 119, 190, 255),  IM_COL32(119, 201, 238, 255),
                                            IM_COL32(52, 160, 100, 255),  IM_COL32(242, 212, 63, 255),
                                            IM_COL32(190, 100, 190, 255), IM_COL32(226, 160, 214, 255),
                                            IM_COL32(238, 110, 110, 255), IM_COL32(200, 205, 208, 255),
                                            IM_COL32(118, 130, 138, 255), IM_COL32(240, 150, 80, 255)};
constexpr const char* kPhaseLabels[kNumPhases] = {"sort",  "grid", "collide, move", "ball",    "map",
                                                  "unmap", "draw", "panel",         "present", "encode"};

std::string grouped(std::uint64_t value) {
  std::string digits = std::to_string(value);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

void text(float x, float y, ImU32 color, const std::string& what, float size = 1.0F) {
  ImGui::GetWindowDrawList()->AddText(ImGui::GetFont(), ImGui::GetFontSize() * size, ImVec2(x, y), color,
                                      what.c_str());
}

float text_width(const std::string& what, float size = 1.0F) {
  return ImGui::GetFont()->CalcTextSizeA(ImGui::GetFontSize() * size, 1e9F, 0.0F, what.c_str()).x;
}

void text_right(float right, float y, ImU32 color, const std::string& what, float size = 1.0F) {
  text(right - text_width(what, size), y, color, what, size);
}

// Cut with dots to what fits.
std::string fitting(std::string what, float width) {
  if (text_width(what) <= width) return what;
  while (what.size() > 4 && text_width(what + "...") > width) what.pop_back();
  return what + "...";
}

std::string ms_text(double ms) { return ms < 99.95 ? fmt::format("{:.2f}", ms) : fmt::format("{:.0f}", ms); }

std::string time_text(double seconds) {
  if (seconds >= 1.0) return fmt::format("{:.2f} s", seconds);
  if (seconds >= 1e-3) return fmt::format("{:.2f} ms", 1e3 * seconds);
  return fmt::format("{:.3g} \xC2\xB5s", 1e6 * seconds);
}

std::string speed_text(double slow_motion) {
  if (slow_motion <= 0.0) return "time stands still";
  if (slow_motion > 0.95) return fmt::format("{:.2g} \xC3\x97 real time", slow_motion);
  const double slower = 1.0 / slow_motion;
  const std::string factor = slower < 100.0 ? fmt::format("{:.3g}", slower) : grouped(std::llround(slower));
  return fmt::format("slow motion, 1 s takes {} s", factor);
}

std::string air_text(const FrameView& frame) {
  switch (frame.physics->air) {
    case Air::vacuum:
      return "vacuum";
    case Air::drag:
      return "drag in closed form, no parcels";
    default:
      return grouped(frame.num_parcels) + " parcels";
  }
}

std::string choice_text(const char* path, const Settings& settings) {
  return value_text(find_field(path, "overlay"), settings);
}

// Round number at or above value: 1, 2 or 5 times a power of ten.
double round_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(std::max(value, 1e-6))));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= value) return factor * power;
  }
  return 10.0 * power;
}

void begin_strip(const OverlayPlace& place, float height) {
  ImGui::SetNextWindowPos(ImVec2(place.left_px, place.bottom_px - height));
  ImGui::SetNextWindowSize(ImVec2(place.width_px, height));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0F, 1.0F));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.0F, 0.0F));  // it also clips what is drawn
  ImGui::Begin("overlay", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoBackground |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleVar(2);
  const ImVec2 low(place.left_px, place.bottom_px - height);
  const ImVec2 high(place.left_px + place.width_px, place.bottom_px);
  ImGui::GetWindowDrawList()->AddRectFilled(low, high, kGround);
  ImGui::GetWindowDrawList()->AddLine(low, ImVec2(high.x, low.y), kEdge, place.scale);
}

void show_legend(const FrameView& frame, float x, float y, float width, float scale) {
  const Settings& settings = *frame.settings;
  const double top_mps =
      top_color_speed_mps(settings.parcel_speed_mps, std::hypot(settings.flow_x_mps, settings.flow_y_mps));
  const float row = kRow_px * scale;
  text(x, y, kDim, "parcel speed [m/s]");
  ImDrawList* list = ImGui::GetWindowDrawList();
  constexpr int kNumBars = 48;
  for (int i = 0; i < kNumBars; ++i) {
    const auto c = speed_color((static_cast<float>(i) + 0.5F) / kNumBars);
    const float left = x + width * static_cast<float>(i) / kNumBars;
    list->AddRectFilled(ImVec2(left, y + 1.3F * row), ImVec2(left + width / kNumBars + 0.5F, y + 2.0F * row),
                        ImGui::ColorConvertFloat4ToU32(ImVec4(c[0], c[1], c[2], 1.0F)));
  }
  text(x, y + 2.2F * row, kText, "0");
  const std::string middle = fmt::format("{:.3g}", 0.5 * top_mps);
  text(x + 0.5F * (width - text_width(middle)), y + 2.2F * row, kText, middle);
  text_right(x + width, y + 2.2F * row, kText, fmt::format("{:.3g}+", top_mps));
  if (!frame.physics->ball.present) return;
  const Vec2d v = frame.ball.velocity_mps;
  text(x, y + 3.6F * row, kDim, "ball");
  text_right(x + width, y + 3.6F * row, kText, fmt::format("{:.2f} m/s", std::sqrt(dot(v, v))));
  text(x, y + 4.6F * row, kDim, "spin");
  text_right(x + width, y + 4.6F * row, kText, fmt::format("{:.1f} rad/s", frame.ball.spin_radps));
}

// A rounded notice, centred at the top of the scene; returns where the next one may stand.
float show_chip(const std::string& what, ImU32 color, float y, const OverlayPlace& place) {
  const float width = text_width(what) + 24.0F * place.scale;
  const float height = 26.0F * place.scale;
  const float left = place.left_px + std::max(0.5F * (place.width_px - width), 4.0F);
  ImDrawList* list = ImGui::GetForegroundDrawList();
  list->AddRectFilled(ImVec2(left, y), ImVec2(left + width, y + height), IM_COL32(11, 19, 25, 225),
                      0.5F * height);
  list->AddRect(ImVec2(left, y), ImVec2(left + width, y + height), color, 0.5F * height);
  list->AddText(ImGui::GetFont(), ImGui::GetFontSize(),
                ImVec2(left + 12.0F * place.scale, y + 5.0F * place.scale), kText, what.c_str());
  return y + height + 6.0F * place.scale;
}

void show_notices(const FrameView& frame, const OverlayPlace& place) {
  float y = 10.0F * place.scale;
  if (frame.paused) {
    y = show_chip("Paused: space runs on, S steps", kAccent, y, place);
  } else if (frame.flight == Flight::landed) {
    y = show_chip("The ball has left the court", kAccent, y, place);
  }
  if (!frame.message.empty()) {
    show_chip(fitting(frame.message, place.width_px - 40.0F * place.scale), IM_COL32(238, 110, 110, 255), y,
              place);
  }
}

}  // namespace

float Overlay::height_px(OverlayMode mode, float scale) {
  switch (mode) {
    case OverlayMode::full:
      return (kNumRows * kRow_px + 2.0F * kPadding_px) * scale;
    case OverlayMode::compact:
      return (kRow_px + 10.0F) * scale;
    default:
      return 0.0F;
  }
}

void Overlay::add_frame(const PhaseTimes& times, double frame_ms) {
  kept_[num_added_ % kNumKept] = times;
  // The first frames compile and allocate; afterwards a mean over about 15 frames.
  const double weight = num_added_ < 15 ? 1.0 / static_cast<double>(num_added_ + 1) : 1.0 / 15.0;
  for (std::size_t i = 0; i < kNumPhases; ++i) smooth_.ms[i] += weight * (times.ms[i] - smooth_.ms[i]);
  smooth_frame_ms_ += weight * (frame_ms - smooth_frame_ms_);
  ++num_added_;
}

void Overlay::show(const FrameView& frame, OverlayMode mode, const OverlayPlace& place) const {
  // A strip without room for its columns says the most important in one line.
  const float needed = (kStatusWidth_px + kPhasesWidth_px + 2.0F * kGap_px) * place.scale;
  const bool full = mode == OverlayMode::full && place.width_px >= needed;
  const float height = height_px(mode, place.scale);
  begin_strip(place, std::max(height, 1.0F));
  if (full) {
    show_full(frame, place);
    show_terms(place);
  } else if (mode != OverlayMode::off) {
    show_compact(frame, place);
  }
  show_notices(frame, place);
  ImGui::End();
}

void Overlay::show_full(const FrameView& frame, const OverlayPlace& place) const {
  const float s = place.scale;
  const float y = place.bottom_px - height_px(OverlayMode::full, s) + kPadding_px * s;
  float left = place.left_px + kPadding_px * s;
  float right = place.left_px + place.width_px - kPadding_px * s;
  show_status(frame, left, y, s);
  left += (kStatusWidth_px + kGap_px) * s;
  show_phases(left, y, s);
  left += (kPhasesWidth_px + kGap_px) * s;
  if (right - left > kLegendWidth_px * s) {
    show_legend(frame, right - kLegendWidth_px * s, y, kLegendWidth_px * s, s);
    right -= (kLegendWidth_px + kGap_px) * s;
  }
  if (right - left > 70.0F * s) show_plot(left, y, right - left, kNumRows * kRow_px * s, s);
}

void Overlay::show_compact(const FrameView& frame, const OverlayPlace& place) const {
  const float y = place.bottom_px - height_px(OverlayMode::compact, place.scale) + 4.0F * place.scale;
  const std::string line = fmt::format("{:.0f} frames/s   {:.1f} ms   {}   {}   t = {:.3f} s   {}",
                                       1e3 / std::max(smooth_frame_ms_, 1e-3), smooth_frame_ms_,
                                       air_text(frame), choice_text("run.method", *frame.settings),
                                       frame.simulated_s, speed_text(frame.slow_motion));
  const float padding = kPadding_px * place.scale;
  text(place.left_px + padding, y, kText, fitting(line, place.width_px - 2.0F * padding));
}

void Overlay::show_status(const FrameView& frame, float x, float y, float scale) const {
  const float row = kRow_px * scale;
  const float width = kStatusWidth_px * scale;
  const std::string rate = fmt::format("{:.0f}", 1e3 / std::max(smooth_frame_ms_, 1e-3));
  text(x, y - 2.0F * scale, kAccent, rate, 1.5F);
  text(x + text_width(rate, 1.5F) + 6.0F * scale, y + 3.0F * scale, kDim,
       fmt::format("frames/s   {:.1f} ms", smooth_frame_ms_));
  text(x, y + 1.35F * row, kText, air_text(frame));
  text_right(
      x + width, y + 1.35F * row, kDim,
      choice_text("run.method", *frame.settings) + ", " + choice_text("run.neighbors", *frame.settings));
  text(x, y + 2.3F * row, kText, fmt::format("t = {:.3f} s", frame.simulated_s));
  text_right(x + width, y + 2.3F * row, kDim,
             fmt::format("{} {} of {}", frame.steps_per_frame, frame.steps_per_frame == 1 ? "step" : "steps",
                         time_text(frame.dt_s)));
  text(x, y + 3.25F * row, kText, speed_text(frame.slow_motion));
  std::string hits = grouped(frame.totals.num_collisions) + " collisions";
  if (frame.physics->ball.present) hits += ", " + grouped(frame.totals.num_ball_hits) + " ball hits";
  text(x, y + 4.2F * row, kDim, fitting(hits, width));
  text(x, y + 5.15F * row, kDim, fitting(info_.draw_target, width));
}

void Overlay::show_phases(float x, float y, float scale) const {
  const float row = kRow_px * scale;
  const float column = 0.5F * (kPhasesWidth_px + 16.0F) * scale;
  ImDrawList* list = ImGui::GetWindowDrawList();
  text(x, y, kDim, "milliseconds per frame");
  text_right(x + kPhasesWidth_px * scale, y, kText, ms_text(smooth_.total()));
  for (std::size_t i = 0; i < kNumPhases; ++i) {
    const float left = x + static_cast<float>(i / 5) * column;
    const float top = y + (1.15F + 0.97F * static_cast<float>(i % 5)) * row;
    const float swatch = 9.0F * scale;
    list->AddRectFilled(ImVec2(left, top + 4.0F * scale), ImVec2(left + swatch, top + 4.0F * scale + swatch),
                        kPhaseColors[i], 2.0F * scale);
    const ImU32 color = smooth_.ms[i] < 0.005 ? kDim : kText;
    text(left + 16.0F * scale, top, color, kPhaseLabels[i]);
    text_right(left + column - 16.0F * scale, top, color, ms_text(smooth_.ms[i]));
  }
}

// What all but one in twenty of the kept frames stay below: one slow frame must not flatten the rest.
double Overlay::usual_most_ms(std::size_t count) const {
  if (count == 0) return 0.0;
  std::array<double, kNumKept> totals{};
  for (std::size_t i = 0; i < count; ++i) totals[i] = kept_[i].total();
  const auto middle = totals.begin() + static_cast<std::ptrdiff_t>(count * 19 / 20);
  std::nth_element(totals.begin(), middle, totals.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

// One line above the strip: what a step costs, and each term of it that has been seen both on and off. Left
// out while there is neither a figure nor a panel to switch a term with.
void Overlay::show_terms(const OverlayPlace& place) const {
  std::string line = fmt::format("{:.3f} ms a step", term_costs_.step_ms());
  bool any_unseen = false;
  bool any_seen = false;
  for (std::size_t k = 0; k < kNumTerms; ++k) {
    const std::optional<double> cost = term_costs_.cost_ms(static_cast<Term>(k));
    line += fmt::format(", {} {}", kTermNames[k], cost ? fmt::format("{:.3f}", *cost) : "?");
    any_unseen = any_unseen || !cost;
    any_seen = any_seen || cost;
  }
  if (!any_seen && place.left_px <= 0.0F) return;
  if (any_unseen) line += "   (?: switch it once to see its cost)";
  const float s = place.scale;
  const ImVec2 at(place.left_px + kPadding_px * s,
                  place.bottom_px - height_px(OverlayMode::full, s) - 1.2F * kRow_px * s);
  ImGui::GetForegroundDrawList()->AddText(ImGui::GetFont(), 0.9F * ImGui::GetFontSize(), at, kDim,
                                          line.c_str());
}

void Overlay::show_plot(float x, float y, float width, float height, float scale) const {
  ImDrawList* list = ImGui::GetWindowDrawList();
  const std::size_t count = std::min(num_added_, kNumKept);
  const double top_ms = round_up(1.1 * std::max(usual_most_ms(count), 3.0));
  const auto per_ms = static_cast<float>(height / top_ms);
  const float bar = width / static_cast<float>(kNumKept);
  list->AddRectFilled(ImVec2(x, y), ImVec2(x + width, y + height), IM_COL32(20, 32, 40, 255), 3.0F * scale);
  for (std::size_t i = 0; i < count; ++i) {
    const PhaseTimes& times = kept_[(num_added_ - count + i) % kNumKept];
    const float left = x + width - bar * static_cast<float>(count - i);
    float bottom = y + height;
    for (std::size_t p = 0; p < kNumPhases && bottom > y; ++p) {
      const float top = std::max(bottom - static_cast<float>(times.ms[p]) * per_ms, y);
      if (bottom - top > 0.05F)
        list->AddRectFilled(ImVec2(left, top), ImVec2(left + bar, bottom), kPhaseColors[p]);
      bottom = top;
    }
  }
  constexpr double kBudget_ms = 1000.0 / 60.0;
  if (kBudget_ms < top_ms) {
    const float line = y + height - static_cast<float>(kBudget_ms) * per_ms;
    list->AddLine(ImVec2(x, line), ImVec2(x + width, line), IM_COL32(255, 255, 255, 90), scale);
    text(x + 4.0F * scale, line - 0.85F * ImGui::GetFontSize() - scale, kDim, "1/60 s", 0.8F);
  }
  text_right(x + width - 4.0F * scale, y + 2.0F * scale, kDim, fmt::format("{:g} ms", top_ms), 0.8F);
}

}  // namespace pf
