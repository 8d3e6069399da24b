// The overlay's columns of phases, and the bars of the last frames beside them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <span>

#include "core/round_up.hpp"
#include "core/statistics.hpp"
#include "view/overlay.hpp"
#include "view/overlay_layout.hpp"
#include "view/overlay_text.hpp"
#include "view/phase_styles.hpp"

namespace pf {
namespace {

constexpr float kFirstRow = 1.25F;  // in rows below the heads
constexpr float kPitch = 0.85F;     // six phases and a line below them
constexpr std::size_t kMaxPhases = 6;

ImU32 color_of(Phase phase) {
  const auto [red, green, blue] = style_of(phase).color;
  return IM_COL32(red, green, blue, 255);
}

float column_width(float scale) { return 0.5F * (kPhasesWidth_px + kPhaseGap_px) * scale; }

// Upper left corner of a phase's row: a step's phases at the left, the picture's at the right.
ImVec2 place_of_row(const OverlayPlace& place, bool is_picture, std::size_t row) {
  const Columns at = columns_of(place);
  const float left = at.phases + (is_picture ? column_width(place.scale) : 0.0F);
  return {left, at.top + (kFirstRow + kPitch * static_cast<float>(row)) * kRow_px * place.scale};
}

}  // namespace

void Overlay::write_phases(const OverlayPlace& place, Method method) {
  const Columns at = columns_of(place);
  const float s = place.scale;
  texts_.add(at.phases, at.top, colors_.dim, "ms, median / 99 %");
  texts_.add_right(at.phases + kPhasesWidth_px * s, at.top, colors_.text,
                   fmt::format("{} / {}", ms_text(figures_.total_ms.median), ms_text(figures_.total_ms.p99)));
  shown_phases_ = {step_phases(method), picture_phases()};
  for (std::size_t column = 0; column < shown_phases_.size(); ++column) {
    for (std::size_t row = 0; row < shown_phases_[column].size(); ++row)
      write_phase(place_of_row(place, column == 1, row), s, shown_phases_[column][row]);
  }
  if (figures_.gpu_panel_ms <= 0.0 && figures_.gpu_draw_ms <= 0.0) return;
  const ImVec2 last = place_of_row(place, false, kMaxPhases);
  texts_.add(last.x + 15.0F * s, last.y, colors_.dim,
             fmt::format("by GL's own clock: draw {}, panel {}", ms_text(figures_.gpu_draw_ms),
                         ms_text(figures_.gpu_panel_ms)));
}

void Overlay::write_phase(ImVec2 at, float scale, Phase phase) {
  const float right = at.x + column_width(scale) - kPhaseGap_px * scale;
  const MedianP99& ms = figures_.phase_ms[static_cast<std::size_t>(phase)];
  const bool is_idle = ms.p99 < 0.005;
  const ImU32 color = is_idle ? colors_.dim : colors_.text;
  texts_.add(at.x + 15.0F * scale, at.y, color, style_of(phase).label);
  texts_.add_right(right - 44.0F * scale, at.y, color, ms_text(ms.median));
  texts_.add_right(right, at.y, colors_.dim, ms_text(ms.p99));
}

void Overlay::paint_swatches(const OverlayPlace& place) const {
  const float side = 9.0F * place.scale;
  for (std::size_t column = 0; column < shown_phases_.size(); ++column) {
    for (std::size_t row = 0; row < shown_phases_[column].size(); ++row) {
      ImVec2 low = place_of_row(place, column == 1, row);
      low.y += 4.0F * place.scale;
      ImGui::GetWindowDrawList()->AddRectFilled(low, ImVec2(low.x + side, low.y + side),
                                                color_of(shown_phases_[column][row]));
    }
  }
}

// All but one in twenty of the kept frames stay below this: one slow frame must not flatten the rest.
double Overlay::usual_max_ms() const {
  const std::size_t count = history_.size();
  if (count == 0) return 0.0;
  std::array<double, FrameHistory::kNumKept> totals{};
  for (std::size_t i = 0; i < count; ++i) totals[i] = history_.times(i).total();
  return value_of_rank(std::span(totals).first(count), count * 19 / 20);
}

void Overlay::write_scale(const OverlayPlace& place) {
  top_ms_ = round_up(1.1 * std::max(usual_max_ms(), 3.0));
  const Columns at = columns_of(place);
  if (!at.has_plot) return;
  const float s = place.scale;
  texts_.add_right(at.plot + at.plot_width - 4.0F * s, at.top + 2.0F * s, colors_.dim,
                   fmt::format("{:g} ms", top_ms_), 0.8F);
}

// One stacked bar per frame, the newest at the right.
void Overlay::paint_bars(const Columns& at, float height, float per_ms) const {
  ImDrawList* list = ImGui::GetWindowDrawList();
  const float right = at.plot + at.plot_width;
  const float width = at.plot_width / static_cast<float>(FrameHistory::kNumKept);
  for (std::size_t age = 0; age < history_.size(); ++age) {
    const PhaseTimes& times = history_.times(age);
    const float left = right - width * static_cast<float>(age + 1);
    float bottom = at.top + height;
    for (std::size_t p = 0; p < kNumPhases && bottom > at.top; ++p) {
      const float top = std::max(bottom - static_cast<float>(times.ms[p]) * per_ms, at.top);
      if (bottom - top > 0.05F)
        list->AddRectFilled(ImVec2(left, top), ImVec2(left + width, bottom), color_of(static_cast<Phase>(p)));
      bottom = top;
    }
  }
}

void Overlay::paint_plot(const OverlayPlace& place) const {
  const Columns at = columns_of(place);
  if (!at.has_plot) return;
  const float s = place.scale;
  const float height = static_cast<float>(kNumRows) * kRow_px * s;
  ImDrawList* list = ImGui::GetWindowDrawList();
  const auto per_ms = static_cast<float>(height / top_ms_);
  const float right = at.plot + at.plot_width;
  list->AddRectFilled(ImVec2(at.plot, at.top), ImVec2(right, at.top + height), colors_.plot);
  paint_bars(at, height, per_ms);
  constexpr double kBudget_ms = 1000.0 / 60.0;
  if (kBudget_ms >= top_ms_) return;
  const float line = at.top + height - static_cast<float>(kBudget_ms) * per_ms;
  list->AddLine(ImVec2(at.plot, line), ImVec2(right, line), colors_.line, s);
  constexpr const char* kLabel = "1/60 s";
  const float size = 0.8F * ImGui::GetFontSize();
  const ImVec2 extent = ImGui::GetFont()->CalcTextSizeA(size, FLT_MAX, 0.0F, kLabel);
  const ImVec2 low(at.plot + 4.0F * s, line - extent.y - s);
  list->AddRectFilled(ImVec2(low.x - 2.0F * s, low.y), ImVec2(low.x + extent.x + 2.0F * s, low.y + extent.y),
                      colors_.plot, 2.0F * s);  // bars may reach there
  list->AddText(ImGui::GetFont(), size, low, colors_.text, kLabel);
}

}  // namespace pf
