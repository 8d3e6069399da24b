// The stage while it runs: its members and the parts of a frame. Only the stage's sources include it.
#pragma once

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/cue_player.hpp"
#include "app/flight_pair.hpp"
#include "app/input_log.hpp"
#include "app/live_accuracy.hpp"
#include "app/profile_log.hpp"
#include "app/replay.hpp"
#include "app/settings_history.hpp"
#include "app/term_costs.hpp"
#include "core/progress_line.hpp"
#include "data/run_files.hpp"
#include "view/aim.hpp"
#include "view/ball_camera.hpp"
#include "view/cue_title.hpp"
#include "view/gpu_timer.hpp"
#include "view/gui.hpp"
#include "view/last_seconds.hpp"
#include "view/magnifier.hpp"
#include "view/overlay.hpp"
#include "view/panel.hpp"
#include "view/passing_notice.hpp"
#include "view/recorder.hpp"
#include "view/renderer.hpp"
#include "view/scene_marks.hpp"
#include "view/split_view.hpp"
#include "view/stage.hpp"
#include "view/timeline_bar.hpp"
#include "view/window_input.hpp"

namespace pf {

// The view that a scene asks for.
struct ViewWishes {
  std::int64_t num_scenes = 0;
  bool follow_ball = false;
  MagnifierMode magnifier = MagnifierMode::automatic;
  bool operator==(const ViewWishes&) const = default;
};

// The index of a checked name.
template <class Index>
Index index_of(const std::string& name, const std::vector<std::string>& names) {
  return static_cast<Index>(std::find(names.begin(), names.end(), name) - names.begin());
}

class Stage {
 public:
  Stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
        const StageHooks& hooks);
  int run();

  // Loads a list of cues and goes to its first one. A list with an error changes nothing; a notice says why.
  void load_cues(const std::string& name_or_path);

 private:
  void follow_cue_keys(const InputFrame& input, Commands& commands);
  void follow_cue_panel();
  void tell_if_no_such_cue(bool is_there);
  void tell_of_replay();
  void save_cue(const CueRequest& request);
  Cue present_cue();
  void undo_or_redo(const InputFrame& input, Commands& commands);
  void follow_cues(bool is_new_scene);
  void begin_cue();
  void take_camera(const Cue* cue);
  bool has_marks() const;
  double title_step_s() const;
  bool goes_on_to_next_cue();
  bool scene_ended();
  Commands handle_input();
  void fold_panel();
  void show_keys(const InputFrame& input);
  void aim(const InputFrame& input, Commands& commands);
  void offer_ball(const InputFrame& input);
  double ring_px() const;
  std::optional<Vec2d> ball_near(Vec2d pointer_px, double radii) const;
  void escape(Commands& commands);
  void follow_keys(const InputFrame& input);
  void follow_switches(const Commands& commands);
  void follow_camera(const InputFrame& input);
  float timeline_height_px() const;
  void follow_timeline(Commands& commands);
  void keep_last_seconds(const Viewport& viewport);
  void write_last_seconds();
  void follow_last_seconds(const InputFrame& input);
  bool tables_broke_off();
  std::string reason_of_stop() const;
  void finish_last_seconds();
  void take_dropped(const std::vector<std::string>& files, Commands& commands);
  void follow_wishes();
  void follow_ball();
  void follow_camera_keys(const InputFrame& input);
  void keep_view();
  void pan(Vec2d moved_px);
  void zoom(const InputFrame& input);
  void draw_magnified_air(const ParcelBuffers& parcels);
  void draw_magnified_rest(const FrameView& frame, const Viewport& viewport);
  void note_followed_ball();
  PictureScene large_picture_scene();
  void measure_copy_bandwidth();
  Look look_of_marks() const;
  OverlayPlace place_of_overlay() const;
  OverlayMode shown_overlay() const;
  ViewRegion free_region();
  void fit_camera();
  void begin_steps();
  void follow_split(std::int64_t num_begun_before);
  bool overlay_is_of_first();
  void say_what_was_done();
  void finish_steps();
  void follow_accuracy();
  const char* obstacle_to_terms();
  void follow_terms();
  void describe_overlay();
  void draw_air(const Viewport& viewport);
  void draw_flight(const Viewport& viewport);
  void draw_gui(const Viewport& viewport);
  void take_frame(const Viewport& viewport);
  void present(const Viewport& viewport);
  void follow_fallback();
  void begin_record();
  RunClock clock() const;
  bool is_frame_flown() const;
  void write_panel_map();
  void write_frame_count();
  void steer();
  void steer_to_still();
  double left_to_still_s() const;
  bool ended();
  void refuse_still_before_its_time() const;
  bool still_ended() const;
  double share_done() const;
  void show_progress();
  void say_if_slowed();
  void complete_frame();
  void say_what_flew();
  void say_what_second_flew(const nlohmann::json& split);
  int finish();
  void keep_pace();
  void settle() const;

  const Options& options_;
  GlContext& context_;
  Simulation& simulation_;
  RunRecord& record_;
  const StageHooks& hooks_;
  FlightPair pair_;
  SplitView split_;

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
  std::int64_t aimed_scene_ = 0;  // its number
  bool drag_is_aim_ = false;      // the drag that goes on began as one
  CuePlayer cues_;
  CueTitle title_;
  PxRect title_place_;       // in the last picture
  bool cue_failed_ = false;  // without a window there is nobody to go on then
  SettingsHistory history_;
  std::int64_t gesture_ = 0;  // number of the last press or key
  TimelineBar timeline_;
  PassingNotice notice_;
  std::optional<Vec2d> ring_m_;  // where a ring shows that the ball can be pulled
  bool launched_by_hand_ = false;
  std::vector<Ghost> aimed_ghosts_;
  std::optional<OverlayCsv> csv_;
  std::optional<ProfileCsv> profile_csv_;
  InputLog log_;
  Recorder recorder_;
  LastSeconds last_seconds_;
  std::optional<Replay> replay_;
  std::optional<ProgressLine> progress_;  // of a run without a window
  bool is_slowness_told_ = false;
  bool was_interrupted_ = false;  // by a signal
  RunFiles files_;
  GpuTimer air_timer_, flight_timer_, panel_timer_;
  ColorTarget canvas_;  // of frames that are read back; others go straight to the window

  Camera camera_;
  ViewRegion beside_panel_;  // of the last frame, and its size
  SizePx kept_size_;
  BallCamera ball_camera_;
  Vec2d ball_m_;           // in the frame that is drawn
  ParcelBuffers parcels_;  // of the last frame
  std::unique_ptr<Magnifier> magnifier_;
  float magnifier_px_ = 0.0F;  // side of its square; 0: not shown
  ViewWishes wishes_;
  ViewSwitches switches_;
  bool is_panel_folded_ = false;
  Commands commands_;
  SizePx size_;
  float scale_;  // of text and margins, in pixels per layout pixel
  bool vsync_ = true;
  PhaseTimes times_;   // of the current frame
  DrawTimes drawing_;  // host: of the current frame; GL device: of one or two frames before
  double draw_air_ms_ = 0.0;
  std::string panel_layout_;
  std::ofstream frame_count_;  // beside the panel map
  std::int64_t num_mapped_frames_ = 0;
  std::int64_t first_frame_ = 0;       // above 0 for a run that goes on from a file
  std::int64_t num_frames_ = 0;        // pictures, in a window also of a pause
  std::int64_t num_whole_frames_ = 0;  // without those before the last one of a frame
  std::int64_t num_scene_frames_ = 0;  // whole frames since the scene began
  std::int64_t cue_frame_ = 0;         // the first of the current cue, in a run without a window
  std::int64_t frames_after_flight_ = 0;
  double frame_s_ = 1.0 / 60.0;
  Clock::time_point last_frame_ = Clock::now();
  Clock::time_point next_frame_ = Clock::now();
};

}  // namespace pf
