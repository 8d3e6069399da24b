#include "view/flight_legend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "view/current_color.hpp"
#include "view/figure_text.hpp"
#include "view/overlay_paint.hpp"

namespace pf {
namespace {

// Layout pixels.
constexpr float kLegendMargin_px = 10.0F;
constexpr float kLegendRow_px = 17.0F;
constexpr float kLegendPad_px = 10.0F;
constexpr float kLegendSample_px = 24.0F;  // piece of a path's line
constexpr float kLegendGap_px = 14.0F;     // between columns

float text_size() { return reduced(0.92F); }

std::string step_text(double dt_s) {
  return dt_s >= 1e-3 ? fmt::format("{:.3g} ms", 1e3 * dt_s) : fmt::format("{:.3g} \xC2\xB5s", 1e6 * dt_s);
}

// Mean of all steps: without a set step it follows the ball's speed.
double step_of(const FlightRecord& flight) {
  const bool is_known = flight.num_steps > 0 && flight.time_s() > 0.0;
  return is_known ? flight.time_s() / static_cast<double>(flight.num_steps) : flight.dt_s;
}

// The flight up to a time.
FlightRecord first_part(const FlightRecord& flight, double until_s) {
  FlightRecord part;
  for (std::size_t i = 0; i < flight.points_m.size() && flight.times_s[i] <= until_s; ++i) {
    part.points_m.push_back(flight.points_m[i]);
    part.times_s.push_back(flight.times_s[i]);
  }
  return part;
}

// The common span over which flights of a launch are compared: the shortest of the reference and all complete
// ones.
struct Compared {
  const FlightRecord* reference = nullptr;
  double until_s = 0.0;
};

Compared compared_in(const FrameView& frame) {
  const FlightRecord& current = *frame.flight_record;
  if (!is_compared(current, *frame.old_flights)) return {};
  const FlightRecord& reference = reference_of(current, *frame.old_flights);
  Compared compared = {&reference, reference.time_s()};
  const auto include = [&](const FlightRecord& flight) {
    if (flight.launch == reference.launch && flight.has_left)
      compared.until_s = std::min(compared.until_s, flight.time_s());
  };
  include(current);
  for (const FlightRecord& old : *frame.old_flights) include(old);
  return compared;
}

FlightRow plain_row(const FlightRecord& flight, bool is_current) {
  FlightRow row;
  row.is_current = is_current;
  row.number = fmt::format("{}{}", flight.number, is_current ? ", now" : "");
  row.name = name_of_flight(flight);
  row.method = row.name;
  if (step_of(flight) > 0.0) row.method += ", " + step_text(step_of(flight));
  if (flight.disturbed) row.method += ", changed in flight";
  if (!flight.fresh_air) row.method += ", used air";
  row.has_remark = flight.disturbed || !flight.fresh_air;
  row.speed = digits(length(flight.launch_mps));
  row.spin = digits(flight.spin_radps);
  return row;
}

// Names settings that the user has changed between two flights, so that nobody takes them for a method's
// error.
std::string other_settings(const FlightRecord& flight, const FlightRecord& reference) {
  constexpr std::size_t kMaxNamed = 2;
  const std::vector<const Field*> different = other_differences(flight, reference);
  std::string text;
  for (std::size_t k = 0; k < std::min(kMaxNamed, different.size()); ++k)
    text += fmt::format(", {} {}", different[k]->key, short_value_text(*different[k], flight.settings));
  if (different.size() > kMaxNamed) text += fmt::format(" and {} more", different.size() - kMaxNamed);
  return text;
}

std::string cost_per_second(const FlightRecord& flight) {
  return duration_text(flight.compute_ms / flight.time_s());
}

// Of flights that are not compared: only what unlike durations do not matter for.
void add_cost(const FlightRecord& flight, FlightRow& row) {
  const bool flies = row.is_current && !flight.has_left;
  row.cost = flies ? "..." : flight.time_s() > 0.0 ? cost_per_second(flight) : "-";
}

// Figures of unlike durations are not shown beside each other. The energy is known at a flight's end only.
void compare_row(const FlightRecord& flight, const Compared& compared, FlightRow& row) {
  const bool complete = flight.has_left;
  const bool flies = row.is_current && !complete;
  if (!complete && !flies) row.method += ", cut short";
  const std::string others = other_settings(flight, *compared.reference);
  row.method += others;
  row.has_remark = row.has_remark || (!complete && !flies) || !others.empty();
  row.apart = row.apart_end = row.energy = row.cost = flies ? "..." : "-";
  if (flight.time_s() > 0.0 && (complete || &flight == compared.reference))
    row.cost = cost_per_second(flight);
  const auto drift = complete ? flight.energy_drift() : std::nullopt;
  if (drift) row.energy = drift_text(*drift);
  if (&flight == compared.reference || flight.time_s() < compared.until_s - 1e-9) return;
  const auto distance = distance_between(first_part(*compared.reference, compared.until_s),
                                         first_part(flight, compared.until_s));
  if (!distance) return;
  row.apart_end = length_text(distance->at_end_m);
  row.apart = row.apart_end + ", " + length_text(distance->largest_m);
}

std::vector<const FlightRecord*> in_order(const FrameView& frame, const FlightRecord* first) {
  std::vector<const FlightRecord*> flights = {first};
  if (first != frame.flight_record) flights.push_back(frame.flight_record);
  for (const FlightRecord& old : *frame.old_flights) {
    if (&old != first) flights.push_back(&old);
  }
  return flights;
}

std::string foot_text(const FrameView& frame) {
  const Compared compared = compared_in(frame);
  std::string text;
  if (compared.reference != nullptr) text = fmt::format("compared over {} s", digits(compared.until_s));
  if (frame.half_step) {
    if (!text.empty()) text += "; ";
    text += "half of the scene's time step, Shift+M: the scene's again";
  }
  return text;
}

const std::vector<Ghost>* shown_ghosts(const FrameView& frame, const Look& look) {
  return look.ghosts ? frame.ghosts : nullptr;
}

float height_of(std::size_t num_rows) {
  return kLegendRow_px * static_cast<float>(1 + num_rows) + 1.4F * kLegendPad_px;  // a row of heads
}

// wrap_px: width of the lines; 0: one line.
void write_text(ImVec2 at, ImU32 color, const std::string& text, float wrap_px = 0.0F) {
  ImGui::GetBackgroundDrawList()->AddText(ImGui::GetFont(), text_size() * ImGui::GetFontSize(), at, color,
                                          text.c_str(), nullptr, wrap_px);
}

std::size_t num_lines(const std::string& text, float wrap_px) {
  if (text.empty()) return 0;
  const float size = text_size() * ImGui::GetFontSize();
  const float height = ImGui::GetFont()->CalcTextSizeA(size, 1e9F, wrap_px, text.c_str()).y;
  return static_cast<std::size_t>(std::lround(height / size));
}

// A short piece of a path's line. dash_px: 0 for a solid line.
void paint_sample(ImVec2 at, ImU32 color, float dash_px, float scale) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float width = kLegendSample_px * scale;
  if (dash_px <= 0.0F) {
    list->AddLine(at, ImVec2(at.x + width, at.y), color, 2.5F * scale);
    return;
  }
  for (float x = 0.0F; x < width; x += dash_px)
    list->AddLine(ImVec2(at.x + x, at.y), ImVec2(at.x + std::min(x + 0.6F * dash_px, width), at.y), color,
                  1.5F * scale);
}

}  // namespace

std::vector<FlightRow> flight_rows(const FrameView& frame, Theme theme) {
  const FlightRecord* current = frame.flight_record;
  const FlightRecord* first = &reference_of(*current, *frame.old_flights);
  const Compared compared = compared_in(frame);
  std::vector<FlightRow> rows;
  for (const FlightRecord* flight : in_order(frame, first)) {
    const bool is_current = flight == current;
    rows.push_back(plain_row(*flight, is_current));
    rows.back().color = is_current ? current_flight_color(theme, frame) : flight_color(theme, *flight);
    if (compared.reference == nullptr || flight->launch != first->launch) {
      const std::string others = is_current ? "" : other_settings(*flight, *frame.flight_record);
      rows.back().method += others;
      rows.back().has_remark = rows.back().has_remark || !others.empty();
      if (!frame.old_flights->empty()) add_cost(*flight, rows.back());
      continue;
    }
    compare_row(*flight, compared, rows.back());
  }
  for (FlightRow& row : rows) {
    if (row.has_remark) row.name += " *";
  }
  return rows;
}

bool FlightLegend::is_shown(const FrameView& frame, const Look& look) {
  return look.paths && frame.physics->ball.exists;
}

std::size_t FlightLegend::num_rows(const std::vector<Ghost>* ghosts) const {
  return rows_.size() + (ghosts == nullptr ? 0 : ghosts->size()) + num_foot_lines_;
}

LegendSize FlightLegend::size(const FrameView& frame, const Look& look, float scale) const {
  if (!is_shown(frame, look)) return {};
  constexpr std::size_t kMinFlights = 3;
  const std::size_t flights = std::max(1 + frame.old_flights->size(), kMinFlights);
  const std::size_t num = flights + num_rows(shown_ghosts(frame, look)) - rows_.size();
  return {layout_width_ * scale, (height_of(num) + kLegendMargin_px) * scale};
}

void FlightLegend::write(const FrameView& frame, const Look& look, float scale, float max_width_px) {
  is_resized_ = scale != scale_ || max_width_px != max_width_px_;
  scale_ = scale;
  max_width_px_ = max_width_px;
  const bool is_due = written_flight_ != frame.num_flights || ++frames_since_ >= kFramesPerText;
  if (!is_due && !is_resized_ && !frame.paused) return;
  rows_ = flight_rows(frame, look.theme);
  foot_ = foot_text(frame);
  written_flight_ = frame.num_flights;
  frames_since_ = 0;
  choose_columns();
}

float FlightLegend::column_width(const LegendColumn& column) const {
  float width = 0.0F;
  for (const FlightRow& row : rows_) width = std::max(width, text_width(row.*column.cell, text_size()));
  return width == 0.0F ? 0.0F : std::max(width, text_width(column.head, text_size()));  // an empty one
}

float FlightLegend::columns_width(const std::vector<LegendColumn>& columns) const {
  float width = kLegendSample_px * scale_;
  for (const LegendColumn& column : columns) {
    const float own = column_width(column);
    if (own > 0.0F) width += own + kLegendGap_px * scale_;
  }
  return width;
}

// Columns do not come back as soon as a figure loses a digit: first there must be room for some more.
void FlightLegend::choose_columns() {
  constexpr double kWidthStep = 40.0;  // layout pixels: figures that grow by a digit must not move the world
  const float frame_px = 2.0F * (kLegendPad_px + kLegendMargin_px) * scale_;
  const float room = max_width_px_ - frame_px;
  const auto width_of = [&](int level) { return columns_width(legend_columns(level)); };
  const int tight = fitting_legend_level(0, room, width_of);
  const int loose = fitting_legend_level(tight, room - static_cast<float>(kWidthStep) * scale_, width_of);
  level_ = is_resized_ ? tight : std::clamp(level_, tight, loose);
  columns_ = legend_columns(level_);
  const auto has_remark = [](const FlightRow& row) { return row.has_remark; };
  if (level_ >= kNamesAlone && std::any_of(rows_.begin(), rows_.end(), has_remark))
    foot_ +=
        std::string(foot_.empty() ? "" : "; ") + "*: cut short, changed, in used air, or with other settings";
  widths_px_.clear();
  for (const LegendColumn& column : columns_) widths_px_.push_back(column_width(column));
  text_width_px_ = std::max(columns_width(columns_), std::min(text_width(foot_, text_size()), room));
  num_foot_lines_ = num_lines(foot_, text_width_px_ + 1.0F);
  const double steps = std::ceil((text_width_px_ + frame_px) / (kWidthStep * scale_));
  layout_width_ = std::min(kWidthStep * steps, static_cast<double>(max_width_px_ / scale_));
}

// The text stands at the right of the room that is kept.
PxRect FlightLegend::paint(ImVec2 at, const FrameView& frame, const Look& look, float scale) const {
  const float pad = kLegendPad_px * scale;
  const float width = text_width_px_ + 2.0F * pad;
  const float kept = static_cast<float>(layout_width_) * scale;
  const ImVec2 low(at.x + std::max(kept - width - kLegendMargin_px * scale, 4.0F * scale),
                   at.y + kLegendMargin_px * scale);
  const std::vector<Ghost>* ghosts = shown_ghosts(frame, look);
  const std::size_t rows = num_rows(ghosts);
  const ImVec2 high(low.x + width, low.y + height_of(rows) * scale);
  ImGui::GetBackgroundDrawList()->AddRectFilled(low, high, overlay_colors(look.theme).ground, 5.0F * scale);
  const ImVec2 text(low.x + pad, low.y + 0.7F * pad);
  paint_cells(text, look, scale);
  if (ghosts != nullptr) paint_ghosts(text, *ghosts, look, scale);
  const float foot_y = text.y + kLegendRow_px * scale * static_cast<float>(1 + rows - num_foot_lines_);
  if (!foot_.empty())
    write_text(ImVec2(text.x, foot_y), overlay_colors(look.theme).text, foot_, text_width_px_ + 1.0F);
  return {low.x, low.y, high.x, high.y};
}

void FlightLegend::paint_cells(ImVec2 at, const Look& look, float scale) const {
  const OverlayColors& colors = overlay_colors(look.theme);
  const float row_px = kLegendRow_px * scale;
  float x = at.x + kLegendSample_px * scale;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const LegendColumn& column = columns_[c];
    const float width = widths_px_[c];
    if (width == 0.0F) continue;
    x += kLegendGap_px * scale;
    const auto write = [&](std::size_t row, ImU32 color, const std::string& text) {
      const float left = column.is_number ? x + width - text_width(text, text_size()) : x;
      write_text(ImVec2(left, at.y + row_px * static_cast<float>(row)), color, text);
    };
    write(0, colors.dim, column.head);
    for (std::size_t r = 0; r < rows_.size(); ++r)
      write(r + 1, rows_[r].is_current ? colors.text : colors.dim, rows_[r].*column.cell);
    x += width;
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    paint_sample(ImVec2(at.x, at.y + row_px * (static_cast<float>(r) + 1.5F)), packed(rows_[r].color), 0.0F,
                 scale);
  }
}

void FlightLegend::paint_ghosts(ImVec2 at, const std::vector<Ghost>& ghosts, const Look& look,
                                float scale) const {
  float y = at.y + kLegendRow_px * scale * static_cast<float>(rows_.size() + 1);
  for (const Ghost& ghost : ghosts) {
    paint_sample(ImVec2(at.x, y + 0.5F * kLegendRow_px * scale), packed(theme_colors(look.theme).ghost),
                 ghost_dash_px(ghost.air) * scale, scale);
    write_text(ImVec2(at.x + (kLegendSample_px + kLegendGap_px) * scale, y), overlay_colors(look.theme).dim,
               air_name(ghost.air));
    y += kLegendRow_px * scale;
  }
}

}  // namespace pf
