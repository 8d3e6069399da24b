// The controls at the left edge. They edit a copy of the settings and return commands; they never touch the
// simulation.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "app/simulation.hpp"
#include "view/accuracy_section.hpp"
#include "view/cue_section.hpp"
#include "view/look.hpp"
#include "view/magnifier.hpp"
#include "view/scene_menu.hpp"
#include "view/setting_rows.hpp"
#include "view/split_section.hpp"

namespace pf {

// Switches of the view that the panel shows.
struct ViewSwitches {
  bool show_panel = true;
  bool show_path = true;
  int overlay_mode = 0;   // index of OverlayMode
  Look look;              // its paths are show_path
  double ui_scale = 1.0;  // of text and overlay
  bool vsync = true;
  bool full_screen = false;
  bool show_keys = false;    // the card of keys
  bool follow_ball = false;  // the camera keeps it in the middle
  MagnifierMode magnifier = MagnifierMode::automatic;
  bool has_magnifier = false;  // in the last frame
  bool fit_camera = false;     // requested; the stage clears it
  bool measure_terms = false;  // requested; the stage clears it
  SplitSwitches split;
};

class Panel {
 public:
  // max_parcels: end of the slider of N. draw_target: the kind and the reason for it. gl_device: what draws.
  Panel(std::int64_t max_parcels, std::string draw_target, std::string gl_device);

  // Describes the panel to ImGui, full height at the left edge. Commands::settings is set only if a value
  // changed.
  Commands edit(const FrameView& frame, ViewSwitches& switches, float scale);

  // Figures of the section on accuracy; null: none yet. shows_accuracy: the section is open.
  void set_readout(const AccuracyReadout* readout) { readout_ = readout; }
  bool shows_accuracy() const { return shows_accuracy_; }

  // The settings that the scene, or the cue, began with: what a control goes back to. Null: not known yet.
  void set_scene_settings(const Settings* settings) { scene_settings_ = settings; }
  void set_cues(const CuePlayer* cues) { cues_ = cues; }
  // Requests in the section of cues since the last call.
  CueRequest take_cue_request() { return std::exchange(cue_request_, {}); }

  void set_draw_target(std::string text) { draw_target_ = std::move(text); }
  void set_max_parcels(std::int64_t num) { max_parcels_ = num; }
  // Bounds the panel's share of a window: its text is then smaller than the rest. content_scale: of the
  // screen, which it keeps.
  void fit(float window_px, float content_scale) {
    max_scale_ = std::max(kMaxShare * window_px / kWidth_px, content_scale);
    leaves_room_ = 2.0F * kWidth_px * content_scale <= window_px;
  }
  bool leaves_room() const { return leaves_room_; }  // half of the window or more
  float width_px(float scale) const { return kWidth_px * std::min(scale, max_scale_); }
  const ControlMap& controls() const { return rows_.controls(); }
  ControlMap& controls() { return rows_.controls(); }  // for controls outside the panel

 private:
  static constexpr float kWidth_px = 318.0F;
  static constexpr float kMaxShare = 0.36F;

  void edit_buttons(const FrameView& frame, Commands& commands);
  void edit_main(const FrameView& frame);
  void edit_num_parcels();
  void edit_launch();
  std::optional<double> launch_row(const char* label, const std::string& help, double value,
                                   const SliderLook& look, const NumberRange& range);
  void edit_ball(const FrameView& frame);
  void edit_air(const FrameView& frame);
  void edit_method(const FrameView& frame);
  void edit_view(const FrameView& frame, ViewSwitches& switches);
  void edit_show(const FrameView& frame, ViewSwitches& switches, Commands& commands);
  void edit_look(ViewSwitches& switches);
  void edit_all();

  float max_scale_ = 4.0F;
  bool leaves_room_ = true;
  std::int64_t max_parcels_;
  std::string draw_target_, gl_device_;
  std::int64_t num_threads_;  // of the machine
  SettingRows rows_;
  AccuracySection accuracy_;
  const AccuracyReadout* readout_ = nullptr;
  bool shows_accuracy_ = false;
  SceneMenu scene_menu_;
  SplitSection split_;
  const Settings* scene_settings_ = nullptr;
  const CuePlayer* cues_ = nullptr;
  CueSection cue_section_;
  CueRequest cue_request_;
  std::array<char, 256> scene_file_{};
  double launch_angle_deg_ = 0.0;  // kept here, because a speed of 0 has no direction
};

}  // namespace pf
