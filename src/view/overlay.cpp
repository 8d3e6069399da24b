#include "view/overlay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "view/color_map.hpp"

namespace pf {
namespace {

constexpr float kRow_px = 18.0F;
constexpr int kNumRows = 7;
constexpr float kPadding_px = 12.0F;
constexpr float kStatusWidth_px = 292.0F;
constexpr float kPhasesWidth_px = 330.0F;
constexpr float kLegendWidth_px = 140.0F;
constexpr float kMinPlot_px = 50.0F;
constexpr float kTermsRow_px = 21.0F;  // the line above the strip
constexpr float kGap_px = 22.0F;
constexpr std::uint64_t kFramesPerText = 6;

// In the order of Phase. Distinct in lightness as well as in hue (after Tol's bright and light schemes).
constexpr ImU32 kPhaseColors[kNumPhases] = {IM_COL32(68, 119, 190, 255),  IM_COL32(119, 201, 238, 255),
                                            IM_COL32(52, 160, 100, 255),  IM_COL32(242, 212, 63, 255),
                                            IM_COL32(190, 100, 190, 255), IM_COL32(226, 160, 214, 255),
                                            IM_COL32(238, 110, 110, 255), IM_COL32(170, 176, 180, 255),
                                            IM_COL32(118, 130, 138, 255), IM_COL32(240, 150, 80, 255)};
constexpr const char* kPhaseLabels[kNumPhases] = {"sort",  "grid", "collide", "ball",    "map",
                                                  "unmap", "draw", "panel",   "present", "encode"};

std::string grouped(std::uint64_t value) {
  std::string digits = std::to_string(value);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

// Three digits and k, M, G or T.
std::string short_number(double value) {
  constexpr const char* kUnits[] = {"", "k", "M", "G", "T"};
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < std::size(kUnits)) {
    value *= 1e-3;
    ++unit;
  }
  const int decimals = unit == 0 || value >= 99.95 ? 0 : (value >= 9.995 ? 1 : 2);
  return fmt::format("{:.{}f}{}{}", value, decimals, unit > 0 ? " " : "", kUnits[unit]);
}

std::string ms_text(double ms) {
  return ms < 9.995 ? fmt::format("{:.2f}", ms) : fmt::format("{:.{}f}", ms, ms < 99.95 ? 1 : 0);
}

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

void begin_strip(const OverlayPlace& place, float height, const OverlayColors& colors) {
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
  ImGui::GetWindowDrawList()->AddRectFilled(low, high, colors.ground);
  ImGui::GetWindowDrawList()->AddLine(low, ImVec2(high.x, low.y), colors.edge, place.scale);
}

// Where the columns of the full strip begin.
struct Columns {
  float top, status, phases, plot, plot_width, legend;
  bool has_plot, has_legend;
};

Columns columns_of(const OverlayPlace& place) {
  const float s = place.scale;
  Columns at{};
  at.top = place.bottom_px - Overlay::height_px(OverlayMode::full, s) + kPadding_px * s;
  at.status = place.left_px + kPadding_px * s;
  at.phases = at.status + (kStatusWidth_px + kGap_px) * s;
  at.plot = at.phases + (kPhasesWidth_px + kGap_px) * s;
  float right = place.left_px + place.width_px - kPadding_px * s;
  at.has_legend = right - at.plot > kLegendWidth_px * s;
  at.legend = right - kLegendWidth_px * s;
  if (at.has_legend) right = at.legend - kGap_px * s;
  at.plot_width = right - at.plot;
  at.has_plot = at.plot_width > kMinPlot_px * s;
  return at;
}

double top_speed_mps(const Settings& settings) {
  return top_color_speed_mps(settings.parcel_speed_mps, std::hypot(settings.flow_x_mps, settings.flow_y_mps));
}

}  // namespace

OverlayMode Overlay::fitting_mode(OverlayMode mode, float width_px, float scale) {
  const float needed = (kStatusWidth_px + kPhasesWidth_px + kGap_px + 2.0F * kPadding_px) * scale;
  return mode == OverlayMode::full && width_px < needed ? OverlayMode::compact : mode;
}

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

float Overlay::used_height_px(OverlayMode mode, float scale) const {
  const bool has_terms = mode == OverlayMode::full && !terms_.empty();
  return height_px(mode, scale) + (has_terms ? kTermsRow_px * scale : 0.0F);
}

void Overlay::add_frame(const PhaseTimes& times, double frame_ms, const FrameView& frame,
                        const DrawTimes& drawing) {
  history_.add(times, frame_ms, frame, drawing);
  term_costs_.add_frame(frame);
}

void Overlay::show(const FrameView& frame, OverlayMode mode, const OverlayPlace& place, const Look& look) {
  mode = fitting_mode(mode, place.width_px, place.scale);
  if (mode == OverlayMode::off) return;
  const bool is_moved = mode != written_mode_ || !(place == written_place_) || look.theme != written_theme_;
  const bool is_due = every_frame_ || frame.paused || history_.num_added() >= written_at_ + kFramesPerText;
  if (is_moved || is_due) write_texts(frame, mode, place, look);
  begin_strip(place, height_px(mode, place.scale), colors_);
  if (mode == OverlayMode::full) {
    paint_swatches(place);
    paint_legend(frame, place, look);
    paint_plot(place);
  }
  texts_.paint(ImGui::GetWindowDrawList());
  ImGui::End();
  if (mode != OverlayMode::full || terms_.empty()) return;
  const ImVec2 at(place.left_px + kPadding_px * place.scale,
                  place.bottom_px - height_px(mode, place.scale) - kTermsRow_px * place.scale);
  ImGui::GetBackgroundDrawList()->AddText(ImGui::GetFont(), 0.9F * ImGui::GetFontSize(), at, colors_.dim,
                                          terms_.c_str());
}

void Overlay::write_texts(const FrameView& frame, OverlayMode mode, const OverlayPlace& place,
                          const Look& look) {
  colors_ = overlay_colors(look.theme);
  written_mode_ = mode;
  written_place_ = place;
  written_theme_ = look.theme;
  written_at_ = history_.num_added();
  figures_ = history_.figures(info_.copy_bytes_per_s);
  top_ms_ = round_up(1.1 * std::max(usual_most_ms(), 3.0));
  texts_.clear();
  if (mode == OverlayMode::full) {
    write_full(frame, place);
  } else {
    write_compact(frame, place);
  }
}

void Overlay::write_full(const FrameView& frame, const OverlayPlace& place) {
  const Columns at = columns_of(place);
  write_status(frame, at.status, at.top, place.scale);
  write_work(frame, at.status, at.top, place.scale);
  write_phases(at.phases, at.top, place.scale);
  if (at.has_legend) write_legend(frame, at.legend, at.top, place.scale);
  if (at.has_plot) {
    const float s = place.scale;
    texts_.add_right(at.plot + at.plot_width - 4.0F * s, at.top + 2.0F * s, colors_.dim,
                     fmt::format("{:g} ms", top_ms_), 0.8F);
  }
  write_terms(place);
}

void Overlay::write_compact(const FrameView& frame, const OverlayPlace& place) {
  const float y = place.bottom_px - height_px(OverlayMode::compact, place.scale) + 4.0F * place.scale;
  const double frame_ms = figures_.frame_ms.median;
  const std::string line =
      fmt::format("{:.0f} frames/s   {:.1f} ms   {}   {}   t = {:.3f} s   {}", 1e3 / std::max(frame_ms, 1e-3),
                  frame_ms, air_text(frame), choice_text("run.method", *frame.settings), frame.simulated_s,
                  speed_text(frame.slow_motion));
  const float padding = kPadding_px * place.scale;
  texts_.add(place.left_px + padding, y, colors_.text, fitting(line, place.width_px - 2.0F * padding));
}

void Overlay::write_status(const FrameView& frame, float x, float y, float scale) {
  const float row = kRow_px * scale;
  const float right = x + kStatusWidth_px * scale;
  const MedianP99& frame_ms = figures_.frame_ms;
  const std::string rate = fmt::format("{:.0f}", 1e3 / std::max(frame_ms.median, 1e-3));
  texts_.add(x, y - 3.0F * scale, colors_.accent, rate, 1.5F);
  texts_.add(x + text_width(rate, 1.5F) + 6.0F * scale, y + 2.0F * scale, colors_.dim,
             info_.vsync ? "frames/s, vsync" : "frames/s");
  texts_.add_right(right, y + 2.0F * scale, colors_.dim,
                   fmt::format("{} ms, 99 %: {}", ms_text(frame_ms.median), ms_text(frame_ms.p99)));
  texts_.add(x, y + 1.3F * row, colors_.text, air_text(frame));
  texts_.add_right(
      right, y + 1.3F * row, colors_.dim,
      choice_text("run.method", *frame.settings) + ", " + choice_text("run.neighbors", *frame.settings));
  texts_.add(x, y + 2.25F * row, colors_.text, fmt::format("t = {:.3f} s", frame.simulated_s));
  texts_.add_right(right, y + 2.25F * row, colors_.dim,
                   fmt::format("{} {} of {}", frame.steps_per_frame,
                               frame.steps_per_frame == 1 ? "step" : "steps", time_text(frame.dt_s)));
  texts_.add(x, y + 3.2F * row, colors_.text, speed_text(frame.slow_motion));
}

// What is computed, how fast, and where it lies.
void Overlay::write_work(const FrameView& frame, float x, float y, float scale) {
  const float row = kRow_px * scale;
  const float width = kStatusWidth_px * scale;
  const StepTotals& totals = frame.totals;
  std::string events = grouped(totals.num_collisions) + " collisions";
  if (frame.settings->method == Method::exact) {
    events += fmt::format(", {} rounds, {} redone", frame.frame_totals.num_rounds,
                          frame.frame_totals.num_retried_steps);
  } else if (frame.physics->ball.exists) {
    events += ", " + grouped(totals.num_ball_hits) + " ball hits";
  }
  texts_.add(x, y + 4.15F * row, colors_.dim, fitting(events, width));
  if (figures_.particle_steps_per_s > 0.0) {
    texts_.add(x, y + 5.1F * row, colors_.text,
               short_number(figures_.particle_steps_per_s) + " parcel-steps/s");
    if (figures_.copy_share > 0.0) {
      texts_.add_right(x + width, y + 5.1F * row, colors_.dim,
                       fmt::format("{:.1f} % of copying", 100.0 * figures_.copy_share));
    }
  }
  const std::string memory = fmt::format("{}B {}", short_number(static_cast<double>(frame.memory_bytes)),
                                         frame.backend == "cuda" ? "GPU" : "RAM");
  texts_.add_right(x + width, y + 6.05F * row, colors_.dim, memory);
  texts_.add(x, y + 6.05F * row, colors_.dim,
             fitting(info_.draw_target, width - text_width(memory) - 10.0F * scale));
}

void Overlay::write_phases(float x, float y, float scale) {
  const float row = kRow_px * scale;
  const float width = kPhasesWidth_px * scale;
  const float column = 0.5F * (width + 18.0F * scale);
  texts_.add(x, y, colors_.dim, "ms, median / 99 %");
  texts_.add_right(x + width, y, colors_.text,
                   fmt::format("{} / {}", ms_text(figures_.total_ms.median), ms_text(figures_.total_ms.p99)));
  for (std::size_t i = 0; i < kNumPhases; ++i) {
    const float left = x + static_cast<float>(i / 5) * column;
    const float right = left + column - 18.0F * scale;
    const float top = y + (1.35F + 1.0F * static_cast<float>(i % 5)) * row;
    const MedianP99& ms = figures_.phase_ms[i];
    const bool is_idle = ms.p99 < 0.005;
    texts_.add(left + 15.0F * scale, top, is_idle ? colors_.dim : colors_.text, kPhaseLabels[i]);
    texts_.add_right(right - 44.0F * scale, top, is_idle ? colors_.dim : colors_.text, ms_text(ms.median));
    texts_.add_right(right, top, colors_.dim, ms_text(ms.p99));
  }
  if (figures_.gpu_panel_ms <= 0.0 && figures_.gpu_draw_ms <= 0.0) return;
  texts_.add(x + 15.0F * scale, y + 6.35F * row, colors_.dim,
             fmt::format("by GL's own clock: draw {}, panel {}", ms_text(figures_.gpu_draw_ms),
                         ms_text(figures_.gpu_panel_ms)));
}

void Overlay::paint_swatches(const OverlayPlace& place) const {
  const Columns at = columns_of(place);
  const float s = place.scale;
  const float column = 0.5F * (kPhasesWidth_px + 18.0F) * s;
  const float side = 9.0F * s;
  for (std::size_t i = 0; i < kNumPhases; ++i) {
    const float left = at.phases + static_cast<float>(i / 5) * column;
    const float top = at.top + (1.35F + 1.0F * static_cast<float>(i % 5)) * kRow_px * s + 4.0F * s;
    ImGui::GetWindowDrawList()->AddRectFilled(ImVec2(left, top), ImVec2(left + side, top + side),
                                              kPhaseColors[i]);
  }
}

void Overlay::write_legend(const FrameView& frame, float x, float y, float scale) {
  const float row = kRow_px * scale;
  const float width = kLegendWidth_px * scale;
  const double top_mps = top_speed_mps(*frame.settings);
  texts_.add(x, y, colors_.dim, "parcel speed [m/s]");
  texts_.add(x, y + 2.2F * row, colors_.text, "0");
  const std::string middle = fmt::format("{:.3g}", 0.5 * top_mps);
  texts_.add(x + 0.5F * (width - text_width(middle)), y + 2.2F * row, colors_.text, middle);
  texts_.add_right(x + width, y + 2.2F * row, colors_.text, fmt::format("{:.3g}+", top_mps));
  if (!frame.physics->ball.exists) return;
  const Vec2d v = frame.ball.velocity_mps;
  texts_.add(x, y + 3.9F * row, colors_.dim, "ball");
  texts_.add_right(x + width, y + 3.9F * row, colors_.text, fmt::format("{:.2f} m/s", std::sqrt(dot(v, v))));
  texts_.add(x, y + 4.95F * row, colors_.dim, "spin");
  texts_.add_right(x + width, y + 4.95F * row, colors_.text,
                   fmt::format("{:.1f} rad/s", frame.ball.spin_radps));
  texts_.add(x, y + 6.0F * row, colors_.dim, "flown");
  texts_.add_right(x + width, y + 6.0F * row, colors_.text, fmt::format("{:.2f} m", frame.ball_distance_m));
}

void Overlay::paint_legend(const FrameView&, const OverlayPlace& place, const Look& look) const {
  const Columns at = columns_of(place);
  if (!at.has_legend) return;
  const float row = kRow_px * place.scale;
  constexpr int kNumBars = 48;
  const float bar = kLegendWidth_px * place.scale / kNumBars;
  for (int i = 0; i < kNumBars; ++i) {
    const float left = at.legend + bar * static_cast<float>(i);
    ImGui::GetWindowDrawList()->AddRectFilled(
        ImVec2(left, at.top + 1.3F * row), ImVec2(left + bar + 0.5F, at.top + 2.0F * row),
        packed(speed_color((static_cast<float>(i) + 0.5F) / kNumBars, look)));
  }
}

// What all but one in twenty of the kept frames stay below: one slow frame must not flatten the rest.
double Overlay::usual_most_ms() const {
  const std::size_t count = history_.size();
  if (count == 0) return 0.0;
  std::array<double, FrameHistory::kNumKept> totals{};
  for (std::size_t i = 0; i < count; ++i) totals[i] = history_.times(i).total();
  const auto middle = totals.begin() + static_cast<std::ptrdiff_t>(count * 19 / 20);
  std::nth_element(totals.begin(), middle, totals.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

// One line above the strip: what a step costs, and each term of it that has been seen both on and off. Left
// out while there is neither a figure nor a panel to switch a term with.
void Overlay::write_terms(const OverlayPlace& place) {
  terms_.clear();
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
  terms_ = fitting(line, place.width_px - 2.0F * kPadding_px * place.scale);
}

void Overlay::paint_plot(const OverlayPlace& place) const {
  const Columns at = columns_of(place);
  if (!at.has_plot) return;
  const float s = place.scale;
  const float height = kNumRows * kRow_px * s;
  ImDrawList* list = ImGui::GetWindowDrawList();
  const auto per_ms = static_cast<float>(height / top_ms_);
  const float right = at.plot + at.plot_width;
  const float bar = at.plot_width / static_cast<float>(FrameHistory::kNumKept);
  list->AddRectFilled(ImVec2(at.plot, at.top), ImVec2(right, at.top + height), colors_.plot);
  for (std::size_t age = 0; age < history_.size(); ++age) {
    const PhaseTimes& times = history_.times(age);
    const float left = right - bar * static_cast<float>(age + 1);
    float bottom = at.top + height;
    for (std::size_t p = 0; p < kNumPhases && bottom > at.top; ++p) {
      const float top = std::max(bottom - static_cast<float>(times.ms[p]) * per_ms, at.top);
      if (bottom - top > 0.05F)
        list->AddRectFilled(ImVec2(left, top), ImVec2(left + bar, bottom), kPhaseColors[p]);
      bottom = top;
    }
  }
  constexpr double kBudget_ms = 1000.0 / 60.0;
  if (kBudget_ms >= top_ms_) return;
  const float line = at.top + height - static_cast<float>(kBudget_ms) * per_ms;
  list->AddLine(ImVec2(at.plot, line), ImVec2(right, line), colors_.line, s);
  list->AddText(ImGui::GetFont(), 0.8F * ImGui::GetFontSize(),
                ImVec2(at.plot + 4.0F * s, line - 0.85F * ImGui::GetFontSize() - s), colors_.dim, "1/60 s");
}

}  // namespace pf
