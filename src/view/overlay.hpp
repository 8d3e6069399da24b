// The instrument strip at the lower edge: where each millisecond goes, what is simulated, what the colours
// mean.
#pragma once

#include <string>

#include "app/simulation.hpp"
#include "view/look.hpp"
#include "view/overlay_figures.hpp"
#include "view/overlay_paint.hpp"
#include "view/term_costs.hpp"

namespace pf {

enum class OverlayMode { full, compact, off };  // in the order of kOverlayNames (app/options.hpp)

constexpr int kNumOverlayModes = 3;

// Pixels from the top left.
struct OverlayPlace {
  float left_px = 0.0F;
  float width_px = 0.0F;
  float bottom_px = 0.0F;  // lower edge
  float scale = 1.0F;

  bool operator==(const OverlayPlace&) const = default;
};

class Overlay {
 public:
  // every_frame: the figures follow every frame, for pictures; else they stay for a few, to be read.
  Overlay(OverlayInfo info, bool every_frame) : info_(std::move(info)), every_frame_(every_frame) {}

  // One frame's phases, the wall time from the last frame to this one, and what the GL device took.
  void add_frame(const PhaseTimes& times, double frame_ms, const FrameView& frame, const DrawTimes& drawing);
  // Describes the strip to ImGui.
  void show(const FrameView& frame, OverlayMode mode, const OverlayPlace& place, const Look& look);
  void set_draw_target(std::string text) { info_.draw_target = std::move(text); }
  void set_copy_bandwidth(double bytes_per_s) { info_.copy_bytes_per_s = bytes_per_s; }
  void set_vsync(bool on) { info_.vsync = on; }
  const OverlayInfo& info() const { return info_; }
  const FrameHistory& history() const { return history_; }

  // What is shown of a mode: a strip too narrow for its columns has the most important in one line.
  static OverlayMode fitting_mode(OverlayMode mode, float width_px, float scale);
  // Height that the strip takes.
  static float height_px(OverlayMode mode, float scale);
  // With the line above it, if there is one.
  float used_height_px(OverlayMode mode, float scale) const;

 private:
  void write_texts(const FrameView& frame, OverlayMode mode, const OverlayPlace& place, const Look& look);
  void write_full(const FrameView& frame, const OverlayPlace& place);
  void write_compact(const FrameView& frame, const OverlayPlace& place);
  void write_status(const FrameView& frame, float x, float y, float scale);
  void write_work(const FrameView& frame, float x, float y, float scale);
  void write_phases(float x, float y, float scale);
  void write_terms(const OverlayPlace& place);
  void write_legend(const FrameView& frame, float x, float y, float scale);
  void paint_swatches(const OverlayPlace& place) const;
  void paint_legend(const FrameView& frame, const OverlayPlace& place, const Look& look) const;
  void paint_plot(const OverlayPlace& place) const;
  double usual_most_ms() const;

  OverlayInfo info_;
  bool every_frame_;
  TermCosts term_costs_;
  FrameHistory history_;
  // What was written last, for what, and when.
  TextSheet texts_;
  std::string terms_;
  OverlayFigures figures_;
  OverlayColors colors_{};
  OverlayMode written_mode_ = OverlayMode::off;
  OverlayPlace written_place_;
  Theme written_theme_ = Theme::dark;
  std::uint64_t written_at_ = 0;  // frames added by then
  double top_ms_ = 1.0;           // upper end of the plot
};

}  // namespace pf
