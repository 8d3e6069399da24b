#include "view/overlay.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "view/color_map.hpp"
#include "view/figure_text.hpp"
#include "view/overlay_layout.hpp"
#include "view/overlay_text.hpp"

namespace pf {
namespace {

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

}  // namespace

OverlayMode Overlay::fitting_mode(OverlayMode mode, const OverlayPlace& place) {
  if (mode != OverlayMode::full) return mode;
  const float needed = (kStatusWidth_px + kPhasesWidth_px + kGap_px + 2.0F * kPadding_px) * place.scale;
  const bool fits = place.width_px >= needed && height_px(mode, place.scale) <= 0.4F * place.bottom_px;
  return fits ? OverlayMode::full : OverlayMode::compact;
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
  const bool has_terms = mode == OverlayMode::full && !info_.terms.empty();
  return height_px(mode, scale) + (has_terms ? kTermsRow_px * scale : 0.0F);
}

void Overlay::add_frame(const PhaseTimes& times, double frame_ms, const FrameView& frame,
                        const DrawTimes& drawing) {
  history_.add(times, frame_ms, frame, drawing);
}

void Overlay::show(const FrameView& frame, OverlayMode mode, const OverlayPlace& place, const Look& look) {
  mode = fitting_mode(mode, place);
  if (mode == OverlayMode::off) return;
  const bool is_moved = mode != written_mode_ || !(place == written_place_) || look.theme != written_theme_;
  const bool is_still = frame.paused || frame.flight == Flight::landed;  // adds no frames
  const bool is_due = every_frame_ || is_still || history_.num_added() >= written_at_ + kFramesPerText;
  if (is_moved || is_due) write_texts(frame, mode, place, look);
  begin_strip(place, height_px(mode, place.scale), colors_);
  if (mode == OverlayMode::full) {
    paint_swatches(place);
    paint_legend(place, look);
    paint_plot(place);
  }
  texts_.paint(ImGui::GetWindowDrawList());
  ImGui::End();
  if (mode != OverlayMode::full || terms_.empty()) return;
  const ImVec2 at(place.left_px + kPadding_px * place.scale,
                  place.bottom_px - height_px(mode, place.scale) - kTermsRow_px * place.scale);
  const ImVec2 high(place.left_px + place.width_px, at.y + kTermsRow_px * place.scale);
  ImDrawList* list = ImGui::GetBackgroundDrawList();  // the world may be zoomed to below it
  list->AddRectFilled(ImVec2(place.left_px, at.y - 2.0F * place.scale), high, colors_.ground);
  list->AddText(ImGui::GetFont(), reduced(0.9F) * ImGui::GetFontSize(), at, colors_.dim, terms_.c_str());
}

void Overlay::write_texts(const FrameView& frame, OverlayMode mode, const OverlayPlace& place,
                          const Look& look) {
  colors_ = overlay_colors(look.theme);
  written_mode_ = mode;
  written_place_ = place;
  written_theme_ = look.theme;
  written_at_ = history_.num_added();
  figures_ = history_.figures(info_.copy_bytes_per_s);
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
  write_phases(place, frame.settings->method);
  write_scale(place);
  if (at.has_legend) write_legend(frame, at.legend, at.top, place.scale);
  write_terms(place);
}

void Overlay::write_compact(const FrameView& frame, const OverlayPlace& place) {
  const float y = place.bottom_px - height_px(OverlayMode::compact, place.scale) + 4.0F * place.scale;
  const double frame_ms = figures_.frame_ms.median;
  const std::vector<LinePart> parts = {{rate_text(frame_ms) + " frames/s", 3},
                                       {fmt::format("{:.1f} ms", frame_ms), 1},
                                       {air_text(frame), 2},
                                       {value_text("run.method", *frame.settings), 5},
                                       {clock_text(frame), 6},
                                       {pace(frame), 4}};
  const float padding = kPadding_px * place.scale;
  const float width = place.width_px - 2.0F * padding;
  const auto width_of = [](const std::string& text) { return text_width(text); };
  std::string line = fitting_parts(parts, width, width_of);
  const float size = fitting_size(line, width);  // the time alone may be too long, and must not be cut
  texts_.add(place.left_px + padding, y + 0.5F * (1.0F - size) * ImGui::GetFontSize(), colors_.text,
             std::move(line), size);
}

std::string Overlay::pace(const FrameView& frame) const {
  const double frame_ms = figures_.frame_ms.median;
  return pace_text(frame, every_frame_ || frame_ms <= 0.0 ? 0.0 : 1e3 / frame_ms);
}

void Overlay::write_status(const FrameView& frame, float x, float y, float scale) {
  const float row = kRow_px * scale;
  const float right = x + kStatusWidth_px * scale;
  const MedianP99& frame_ms = figures_.frame_ms;
  const std::string rate = rate_text(frame_ms.median);
  texts_.add(x, y - 3.0F * scale, colors_.accent, rate, 1.5F);
  texts_.add(x + text_width(rate, 1.5F) + 6.0F * scale, y + 2.0F * scale, colors_.dim,
             info_.vsync ? "frames/s, vsync" : "frames/s");
  texts_.add_right(right, y + 2.0F * scale, colors_.dim,
                   fmt::format("{} ms, 99 %: {}", ms_text(frame_ms.median), ms_text(frame_ms.p99)));
  texts_.add(x, y + 1.3F * row, colors_.text, air_text(frame));
  texts_.add_right(
      right, y + 1.3F * row, colors_.dim,
      value_text("run.method", *frame.settings) + ", " + value_text("run.neighbors", *frame.settings));
  const std::string clock = clock_text(frame);
  const std::string steps = fmt::format("{} {} of {}", frame.steps_per_frame,
                                        frame.steps_per_frame == 1 ? "step" : "steps", time_text(frame.dt_s));
  texts_.add(x, y + 2.25F * row, colors_.text, clock);
  if (text_width(clock) + text_width(steps) + 8.0F * scale < right - x)
    texts_.add_right(right, y + 2.25F * row, colors_.dim, steps);
  texts_.add(x, y + 3.2F * row, frame.num_pictures > 1 ? colors_.accent : colors_.text,
             fitting(pace(frame), kStatusWidth_px * scale));
}

// The events, the speed of the steps, the memory.
void Overlay::write_work(const FrameView& frame, float x, float y, float scale) {
  const float row = kRow_px * scale;
  const float width = kStatusWidth_px * scale;
  const StepTotals& totals = frame.totals;
  std::string events = counted(totals.num_collisions, "collision") + (frame.num_flights > 1 ? " in all" : "");
  if (frame.settings->method == Method::exact) {
    events += ", " + counted(frame.frame_totals.num_rounds, "round");
  } else if (frame.physics->ball.exists) {
    events += ", " + counted(totals.num_ball_hits, "ball hit");
  }
  texts_.add(x, y + 4.15F * row, colors_.dim, fitting(events, width));
  if (figures_.parcel_steps_per_s > 0.0) {
    texts_.add(x, y + 5.1F * row, colors_.text,
               short_number(figures_.parcel_steps_per_s) + " parcel-steps/s");
    if (frame.settings->method == Method::exact) {
      texts_.add_right(x + width, y + 5.1F * row, colors_.dim, cluster_text(frame.frame_totals));
    } else if (figures_.copy_share > 0.0) {
      texts_.add_right(x + width, y + 5.1F * row, colors_.dim,
                       fmt::format("{:.1f} % of copy bandwidth", 100.0 * figures_.copy_share));
    }
  }
  const std::string memory =
      fmt::format("{}{} {}", short_number(static_cast<double>(frame.memory_bytes)),
                  frame.memory_bytes < 1000 ? " B" : "B", frame.backend == "cuda" ? "GPU" : "RAM");
  texts_.add_right(x + width, y + 6.05F * row, colors_.dim, memory);
  texts_.add(x, y + 6.05F * row, colors_.dim,
             fitting(info_.draw_target, width - text_width(memory) - 10.0F * scale));
}

void Overlay::write_legend(const FrameView& frame, float x, float y, float scale) {
  const float row = kRow_px * scale;
  const float width = kLegendWidth_px * scale;
  const double top_mps = top_color_speed_mps(*frame.settings);
  texts_.add(x, y, colors_.dim, "parcel speed [m/s]");
  texts_.add(x, y + 2.2F * row, colors_.text, "0");
  const std::string middle = rounded_text(0.5 * top_mps), top = rounded_text(top_mps) + "+";
  texts_.add_right(x + width, y + 2.2F * row, colors_.text, top);
  const float room = width - 2.0F * text_width(top) - 8.0F * scale;  // beside it on both sides
  if (text_width(middle) < room)
    texts_.add(x + 0.5F * (width - text_width(middle)), y + 2.2F * row, colors_.text, middle);
  if (!frame.physics->ball.exists) return;
  float line = 3.9F;
  for (const auto& [name, figure] : ball_texts(frame)) {
    texts_.add(x, y + line * row, colors_.dim, name);
    texts_.add_right(x + width, y + line * row, colors_.text, figure);
    line += 1.05F;
  }
}

void Overlay::paint_legend(const OverlayPlace& place, const Look& look) const {
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

void Overlay::write_terms(const OverlayPlace& place) {
  terms_ = info_.terms.empty() ? "" : fitting(info_.terms, place.width_px - 2.0F * kPadding_px * place.scale);
}

}  // namespace pf
