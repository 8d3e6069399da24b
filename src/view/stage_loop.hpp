// The stage while it runs: its members and the parts of a frame. Only the stage's sources include it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/input_log.hpp"
#include "app/live_accuracy.hpp"
#include "app/profile_log.hpp"
#include "app/replay.hpp"
#include "app/term_costs.hpp"
#include "view/aim.hpp"
#include "view/gpu_timer.hpp"
#include "view/gui.hpp"
#include "view/overlay.hpp"
#include "view/panel.hpp"
#include "view/passing_notice.hpp"
#include "view/recorder.hpp"
#include "view/renderer.hpp"
#include "view/scene_marks.hpp"
#include "view/stage.hpp"
#include "view/window_input.hpp"

namespace pf {

class Stage {
 public:
  Stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
        const StageHooks& hooks);
  int run();

 private:
  Commands handle_input();
  void show_keys(const InputFrame& input);
  void aim(const InputFrame& input, Commands& commands);
  void offer_ball(const InputFrame& input);
  double ring_px() const;
  std::optional<Vec2d> ball_near(Vec2d pointer_px, double radii) const;
  void escape(Commands& commands);
  void follow_keys(const InputFrame& input);
  void follow_switches(const Commands& commands);
  void follow_camera(const InputFrame& input);
  void measure_copy_bandwidth();
  Look look_of_marks() const;
  ViewRegion free_region() const;
  void fit_camera();
  void begin_steps();
  void say_what_was_done();
  void finish_steps();
  void follow_accuracy();
  void follow_terms();
  void describe_overlay();
  void draw_air(const Viewport& viewport);
  void draw_flight(const Viewport& viewport);
  void draw_gui(const Viewport& viewport);
  void take_frame(const Viewport& viewport);
  void present(const Viewport& viewport);
  void follow_fallback();
  void begin_record();
  void write_panel_map();
  void steer();
  double left_to_still_s() const;
  bool ended();
  bool still_ended() const;
  int finish();
  void keep_pace();
  void settle() const;

  const Options& options_;
  GlContext& context_;
  Simulation& simulation_;
  RunRecord& record_;
  const StageHooks& hooks_;

  std::unique_ptr<GlDrawTarget> target_;
  std::unique_ptr<WindowInput> input_;  // before gui_, which calls its callbacks
  Gui gui_;
  Renderer renderer_;
  Panel panel_;
  LiveAccuracy accuracy_;
  TermCosts term_costs_;
  Overlay overlay_;
  SceneMarks marks_;
  Aim aim_;
  PassingNotice notice_;
  std::optional<Vec2d> ring_m_;  // where a ring shows that the ball can be pulled
  bool launched_by_hand_ = false;
  std::vector<Ghost> aimed_ghosts_;
  std::optional<OverlayCsv> csv_;
  std::optional<ProfileCsv> profile_csv_;
  InputLog log_;
  Recorder recorder_;
  std::optional<Replay> replay_;
  GpuTimer air_timer_, flight_timer_, panel_timer_;
  ColorTarget canvas_;  // of frames that are read back; others go straight to the window

  Camera camera_;
  ViewSwitches switches_;
  Commands commands_;
  SizePx size_;
  float scale_;  // of text and margins, in pixels per layout pixel
  bool vsync_ = true;
  PhaseTimes times_;   // of the current frame
  DrawTimes drawing_;  // host: of the current frame; GL device: of one or two frames before
  double draw_air_ms_ = 0.0;
  std::string panel_layout_;
  std::int64_t num_frames_ = 0;
  std::int64_t frames_after_flight_ = 0;
  double frame_s_ = 1.0 / 60.0;
  Clock::time_point last_frame_ = Clock::now();
  Clock::time_point next_frame_ = Clock::now();
};

}  // namespace pf
