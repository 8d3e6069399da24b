#include "view/split_card.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "view/figure_text.hpp"
#include "view/overlay_paint.hpp"

namespace pf {
namespace {

// Layout pixels.
constexpr float kCardMargin_px = 10.0F;
constexpr float kCardRow_px = 18.0F;
constexpr float kCardPad_px = 10.0F;
constexpr float kCardSample_px = 18.0F;
constexpr float kCardGap_px = 14.0F;
constexpr std::size_t kNumCardRows = 4;
constexpr std::array<std::string SplitRow::*, 4> kCells = {&SplitRow::name, &SplitRow::distance,
                                                           &SplitRow::energy, &SplitRow::cost};

SplitRow row_of(std::string name, const HalfFigures& half) {
  SplitRow row;
  row.name = std::move(name);
  row.energy = half.energy_drift ? drift_text(*half.energy_drift) : "-";
  row.cost = half.cost_ms_per_s ? duration_text(*half.cost_ms_per_s) : "-";
  return row;
}

// The row of differences between the second flight and the first.
SplitRow difference_row(const PairFigures& figures) {
  const auto& [first, second] = std::pair(figures.first(), figures.second());
  SplitRow row;
  row.name = "difference";
  if (const auto& distance = figures.distance())
    row.distance = length_text(distance->at_end_m) + ", max " + length_text(distance->largest_m);
  if (first.energy_drift && second.energy_drift)
    row.energy = drift_text(*second.energy_drift - *first.energy_drift);
  if (first.cost_ms_per_s && second.cost_ms_per_s && *first.cost_ms_per_s > 0.0) {
    const double ratio = *second.cost_ms_per_s / *first.cost_ms_per_s;
    row.cost = (ratio < 99.5 ? fmt::format("{:.2g}", ratio) : digits(ratio)) + " times";
  }
  return row;
}

}  // namespace

std::vector<SplitRow> split_rows(const FlightPair& pair) {
  const PairFigures& figures = pair.figures();
  const SplitNames names = split_names(*pair.view().settings, pair.difference());
  const double time_s = std::min(figures.first().time_s, figures.second().time_s);
  return {{fmt::format("t = {:.3f} s", time_s), "distance", "energy drift", "cost / s"},
          row_of("1  " + names.first, figures.first()),
          row_of("2  " + names.second, figures.second()),
          difference_row(figures)};
}

SplitColors split_colors(Theme theme, const FlightPair& pair) {
  const Method first = pair.view().settings->method;
  const Method second = pair.second()->settings().method;
  const Rgb other = first == second ? theme_colors(theme).path : method_color(theme, second);
  return {method_color(theme, first), other};
}

LegendSize SplitCard::fit(double max_px, float scale) {
  reduced_ = static_cast<float>(std::min(1.0, max_px / (layout_width_ * scale)));
  return size(scale);
}

LegendSize SplitCard::size(float scale) const {
  const double s = scale * reduced_;
  return {layout_width_ * s, (kNumCardRows * kCardRow_px + 1.4 * kCardPad_px + 2.0 * kCardMargin_px) * s};
}

void SplitCard::write(const FlightPair& pair, float scale) {
  const bool is_still = pair.view().paused || pair.view().flight == Flight::landed;
  if (pair.num_begun() != written_for_ || ++frames_since_ >= kFramesPerText || is_still) {
    std::vector<SplitRow> rows = split_rows(pair);
    const auto name = [](const std::vector<SplitRow>& of, std::size_t half) {
      return half < of.size() ? of[half].name : std::string();
    };
    if (name(rows, 1) != name(rows_, 1) || name(rows, 2) != name(rows_, 2)) layout_width_ = kMinWidth;
    rows_ = std::move(rows);
    written_for_ = pair.num_begun();
    frames_since_ = 0;
  }
  float width = (kCardSample_px + 2.0F * (kCardPad_px + kCardMargin_px)) * scale;
  for (std::size_t c = 0; c < kNumColumns; ++c) {
    widths_px_[c] = 0.0F;
    for (const SplitRow& row : rows_) widths_px_[c] = std::max(widths_px_[c], text_width(row.*kCells[c]));
    width += widths_px_[c] + (c > 0 ? kCardGap_px * scale : 0.0F);
  }
  // In steps, and never narrower for the same two: figures that grow by a digit must not move the world.
  constexpr double kWidthStep = 40.0;
  const double needed = kWidthStep * std::ceil(width / scale / kWidthStep);
  layout_width_ = std::max(layout_width_, needed);
}

void SplitCard::paint(ImVec2 at, const SplitColors& colors, Theme theme, float scale) const {
  const float s = scale * reduced_;
  const float font_px = ImGui::GetFontSize() * reduced_;
  const OverlayColors& paint = overlay_colors(theme);
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const LegendSize whole = size(scale);
  const float margin = kCardMargin_px * s;
  const ImVec2 low(at.x + margin, at.y + margin);
  const ImVec2 high(at.x + static_cast<float>(whole.width_px) - margin,
                    at.y + static_cast<float>(whole.height_px) - margin);
  list->AddRectFilled(low, high, paint.ground, 5.0F * s);
  list->AddRect(low, high, paint.edge, 5.0F * s);
  const float row_px = kCardRow_px * s;
  const float top = low.y + 0.7F * kCardPad_px * s;
  const float left = low.x + kCardPad_px * s;
  for (const std::size_t r : {std::size_t{1}, std::size_t{2}}) {
    const float y = top + row_px * (static_cast<float>(r) + 0.45F);
    list->AddLine(ImVec2(left, y), ImVec2(left + 12.0F * s, y), packed(r == 1 ? colors.first : colors.second),
                  3.0F * s);
  }
  float right = high.x - kCardPad_px * s;  // columns of figures stand at the right
  for (std::size_t c = kNumColumns; c-- > 0;) {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const std::string& text = rows_[r].*kCells[c];
      const float x =
          c == 0 ? left + (r == 0 ? 0.0F : kCardSample_px * s) : right - text_width(text, reduced_);
      const ImU32 color = r == 0 && c > 0 ? paint.dim : r + 1 == rows_.size() ? paint.accent : paint.text;
      list->AddText(ImGui::GetFont(), font_px, ImVec2(x, top + row_px * static_cast<float>(r)), color,
                    text.c_str());
    }
    right -= widths_px_[c] * reduced_ + kCardGap_px * s;
  }
}

}  // namespace pf
