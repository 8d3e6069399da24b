// The strip at the lower edge: the time of each phase, figures of the run, the meaning of the colours.
#pragma once

#include <array>
#include <span>
#include <string>

#include "app/simulation.hpp"
#include "view/look.hpp"
#include "view/overlay_figures.hpp"
#include "view/overlay_paint.hpp"

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

struct Columns;

class Overlay {
 public:
  // every_frame: the figures change with every frame, for pictures; else every few frames, so that they can
  // be read.
  Overlay(OverlayInfo info, bool every_frame) : info_(std::move(info)), every_frame_(every_frame) {}

  // One frame's phases, the wall time from the last frame to this one, and the GL device's times.
  void add_frame(const PhaseTimes& times, double frame_ms, const FrameView& frame, const DrawTimes& drawing);
  // Describes the strip to ImGui.
  void show(const FrameView& frame, OverlayMode mode, const OverlayPlace& place, const Look& look);
  void set_draw_target(std::string text) { info_.draw_target = std::move(text); }
  void set_copy_bandwidth(double bytes_per_s) { info_.copy_bytes_per_s = bytes_per_s; }
  void set_vsync(bool on) { info_.vsync = on; }
  // One line above the strip; empty: none.
  void set_terms(std::string text) { info_.terms = std::move(text); }
  // A copy for a picture or a film, which is not seen at the window's rate.
  Overlay for_picture() const {
    Overlay copy = *this;
    copy.every_frame_ = true;
    return copy;
  }
  const OverlayInfo& info() const { return info_; }
  const FrameHistory& history() const { return history_; }

  // The mode that is shown: a strip becomes one line where it is too narrow for its columns, or would take
  // more than two fifths of the height. place: the lower edge is that of the window or picture.
  static OverlayMode fitting_mode(OverlayMode mode, const OverlayPlace& place);
  static float height_px(OverlayMode mode, float scale);
  // With the line above the strip, if there is one.
  float used_height_px(OverlayMode mode, float scale) const;

 private:
  void write_texts(const FrameView& frame, OverlayMode mode, const OverlayPlace& place, const Look& look);
  void write_full(const FrameView& frame, const OverlayPlace& place);
  void write_compact(const FrameView& frame, const OverlayPlace& place);
  void write_status(const FrameView& frame, float x, float y, float scale);
  void write_work(const FrameView& frame, float x, float y, float scale);
  void write_phases(const OverlayPlace& place, Method method);
  void write_phase(ImVec2 at, float scale, Phase phase);
  void write_scale(const OverlayPlace& place);
  void write_terms(const OverlayPlace& place);
  void write_legend(const FrameView& frame, float x, float y, float scale);
  void paint_swatches(const OverlayPlace& place) const;
  void paint_legend(const OverlayPlace& place, const Look& look) const;
  void paint_plot(const OverlayPlace& place) const;
  void paint_bars(const Columns& at, float height, float per_ms) const;
  double usual_max_ms() const;
  std::string pace(const FrameView& frame) const;

  OverlayInfo info_;
  bool every_frame_;
  FrameHistory history_;
  // The texts written last, and for what and when.
  TextSheet texts_;
  std::string terms_;
  OverlayFigures figures_;
  std::array<std::span<const Phase>, 2> shown_phases_;  // of the step, of the picture
  OverlayColors colors_{};
  OverlayMode written_mode_ = OverlayMode::off;
  OverlayPlace written_place_;
  Theme written_theme_ = Theme::dark;
  std::uint64_t written_at_ = 0;  // frames added by then
  double top_ms_ = 1.0;           // upper end of the plot
};

}  // namespace pf
