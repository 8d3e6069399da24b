// The instrument strip at the lower edge: where each millisecond goes, what is simulated, what the colours
// mean.
#pragma once

#include <array>
#include <string>

#include "app/simulation.hpp"
#include "view/term_costs.hpp"

namespace pf {

enum class OverlayMode { full, compact, off };

constexpr int kNumOverlayModes = 3;

// What the overlay shows beyond the frame: the view's own figures.
struct OverlayInfo {
  std::string device;       // what draws
  std::string draw_target;  // kind and reason
};

// Pixels from the top left.
struct OverlayPlace {
  float left_px = 0.0F;
  float width_px = 0.0F;
  float bottom_px = 0.0F;  // lower edge
  float scale = 1.0F;
};

class Overlay {
 public:
  explicit Overlay(OverlayInfo info) : info_(std::move(info)) {}

  // One frame's phases and the wall time from the last frame to this one.
  void add_frame(const PhaseTimes& times, double frame_ms);
  // What the frame's steps cost, for the cost of each term.
  void add_steps(const FrameView& frame) { term_costs_.add_frame(frame); }
  // Describes the strip, and the notices at the top of the scene, to ImGui.
  void show(const FrameView& frame, OverlayMode mode, const OverlayPlace& place) const;
  void set_draw_target(std::string text) { info_.draw_target = std::move(text); }

  // Height that the strip takes.
  static float height_px(OverlayMode mode, float scale);

 private:
  static constexpr std::size_t kNumKept = 120;

  void show_full(const FrameView& frame, const OverlayPlace& place) const;
  void show_compact(const FrameView& frame, const OverlayPlace& place) const;
  void show_status(const FrameView& frame, float x, float y, float scale) const;
  void show_phases(float x, float y, float scale) const;
  double usual_most_ms(std::size_t count) const;
  void show_terms(const OverlayPlace& place) const;
  void show_plot(float x, float y, float width, float height, float scale) const;

  OverlayInfo info_;
  TermCosts term_costs_;
  std::array<PhaseTimes, kNumKept> kept_{};
  std::size_t num_added_ = 0;
  PhaseTimes smooth_;  // means that follow slowly, so that they can be read
  double smooth_frame_ms_ = 0.0;
};

}  // namespace pf
