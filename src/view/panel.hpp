// The controls at the left edge. They edit a copy of the settings and return commands; the simulation is
// never touched.
#pragma once

#include <cstdint>

#include "app/simulation.hpp"
#include "view/gui.hpp"

namespace pf {

// What the panel shows and switches that is the view's own.
struct ViewSwitches {
  bool show_panel = true;
  bool show_path = true;
  int overlay_mode = 0;     // index of OverlayMode
  bool fit_camera = false;  // asked for; the stage puts it back
};

class Panel {
 public:
  // max_parcels: end of the slider of N.
  explicit Panel(std::int64_t max_parcels) : max_parcels_(max_parcels) {}

  // Describes the panel to ImGui, full height at the left edge. Commands::settings is set only if a value
  // changed.
  Commands edit(const FrameView& frame, ViewSwitches& switches, float scale);

  float width_px(float scale) const { return kWidth_px * scale; }
  const ControlMap& controls() const { return controls_; }

 private:
  static constexpr float kWidth_px = 318.0F;

  void edit_buttons(const FrameView& frame, Commands& commands);
  void edit_main();
  void edit_num_parcels();
  void edit_ball();
  void edit_launch();
  void edit_air();
  void edit_method();
  void edit_view(ViewSwitches& switches);

  void begin_row(const char* label, const char* path);
  void end_row(const char* label, const char* path, bool changed);
  void slider(const char* label, const char* path, double low, double high, const char* format,
              int flags = 0);
  void checkbox(const char* label, const char* path);
  void combo(const char* label, const char* path);
  bool button(const char* label, float width_px, const char* help);
  bool header(const char* label, bool open);

  Settings edited_;
  bool changed_ = false;
  std::int64_t max_parcels_;
  // A change of these spawns the air anew: it is applied when the person lets go, not on the way.
  std::int64_t num_parcels_ = 0;
  bool holds_num_parcels_ = false;
  double area_fraction_ = 0.0;
  bool holds_area_fraction_ = false;
  double launch_angle_deg_ = 0.0;  // remembered here, because a speed of 0 has no direction
  ControlMap controls_;
};

}  // namespace pf
