#include "view/stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "app/input_log.hpp"
#include "app/live_accuracy.hpp"
#include "app/replay.hpp"
#include "core/error.hpp"
#include "view/aim.hpp"
#include "view/gpu_timer.hpp"
#include "view/gui.hpp"
#include "view/host_draw_target.hpp"
#include "view/overlay.hpp"
#include "view/panel.hpp"
#include "view/recorder.hpp"
#include "view/renderer.hpp"
#include "view/scene_marks.hpp"
#include "view/window_input.hpp"

namespace pf {
namespace {

constexpr double kLongestFilm_s = 60.0;  // of a headless run that neither has an end nor a ball that leaves
constexpr double kAfterFlight_s = 0.5;

std::unique_ptr<GlDrawTarget> make_draw_target(const StageHooks& hooks, const std::string& backend) {
  if (hooks.make_draw_target) return hooks.make_draw_target(backend);
  return std::make_unique<HostDrawTarget>("CPU backend");
}

// The place of a checked name.
template <class Index>
Index index_of(const std::string& name, const std::vector<std::string>& names) {
  return static_cast<Index>(std::find(names.begin(), names.end(), name) - names.begin());
}

ViewSwitches switches_of(const Options& options, bool window) {
  ViewSwitches switches;
  switches.show_panel = window ? options.show_panel : options.record_panel;
  switches.show_path = options.show_path || options.ghosts;
  switches.overlay_mode = index_of<int>(options.overlay, kOverlayNames);
  // Without a window what is drawn is the film.
  if (!window && !options.record_overlay) switches.overlay_mode = static_cast<int>(OverlayMode::off);
  switches.look.theme = index_of<Theme>(options.theme, kThemeNames);
  switches.look.color_map = index_of<ColorMap>(options.color_map, kColorMapNames);
  switches.look.ghosts = options.ghosts;
  switches.ui_scale = options.ui_scale;
  switches.vsync = options.vsync;
  switches.full_screen = options.full_screen && window;
  return switches;
}

// Steps of 2^(1/4) from 1, within what the flag takes.
double scaled_text(double scale, int steps) {
  const double place = std::round(4.0 * std::log2(scale)) + steps;
  return std::clamp(std::exp2(0.25 * place), kLeastUiScale, kMostUiScale);
}

std::string describe(const GlDrawTarget& target) {
  return fmt::format("{}: {}", kDrawTargetNames[static_cast<int>(target.kind())], target.reason());
}

class Stage {
 public:
  Stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
        const StageHooks& hooks);
  int run();

 private:
  Commands handle_input();
  void aim(const InputFrame& input, Commands& commands);
  bool is_at_ball(Vec2d pointer_px) const;
  void follow_keys(const InputFrame& input);
  void follow_switches(const Commands& commands);
  void follow_camera(const InputFrame& input);
  void measure_copy_bandwidth();
  Look look_of_marks() const;
  ViewRegion free_region() const;
  void fit_camera();
  void begin_steps();
  void finish_steps();
  void follow_accuracy();
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
  void show_recording();
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
  std::unique_ptr<WindowInput> input_;  // before gui_, which calls on to it
  Gui gui_;
  Renderer renderer_;
  Panel panel_;
  LiveAccuracy accuracy_;
  Overlay overlay_;
  SceneMarks marks_;
  Aim aim_;
  std::vector<Ghost> aimed_ghosts_;
  std::optional<OverlayCsv> csv_;
  InputLog log_;
  Recorder recorder_;
  std::optional<Replay> replay_;
  GpuTimer air_timer_, flight_timer_, panel_timer_;
  ColorTarget canvas_;  // the frame, where it is read back; else the window is drawn to directly

  Camera camera_;
  ViewSwitches switches_;
  Commands commands_;
  SizePx size_;
  float scale_;  // of text and margins, in pixels per layout pixel
  bool vsync_ = true;
  PhaseTimes times_;   // of the frame in hand
  DrawTimes drawing_;  // the host's of the frame in hand, the GL device's of one or two before it
  double draw_air_ms_ = 0.0;
  std::string panel_layout_;
  std::int64_t num_frames_ = 0;
  std::int64_t frames_after_flight_ = 0;
  double frame_s_ = 1.0 / 60.0;
  Clock::time_point last_frame_ = Clock::now();
  Clock::time_point next_frame_ = Clock::now();
};

Stage::Stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
             const StageHooks& hooks)
    : options_(options),
      context_(context),
      simulation_(simulation),
      record_(record),
      hooks_(hooks),
      target_(make_draw_target(hooks, simulation.backend().name())),
      input_(context.window() == nullptr ? nullptr : std::make_unique<WindowInput>(context.window())),
      gui_(context),
      panel_(hooks.max_parcels, describe(*target_)),
      overlay_({context.info().renderer, describe(*target_)},
               context.window() == nullptr && options.bench_frames == 0),
      log_(simulation, simulation.backend().name()),
      recorder_(options, context.window() != nullptr, hooks.announce, log_),
      air_timer_(context.info().software),
      flight_timer_(context.info().software),
      panel_timer_(context.info().software),
      scale_(context.content_scale() * static_cast<float>(options.ui_scale)),
      vsync_(options.vsync) {
  const bool has_window = context.window() != nullptr;
  switches_ = switches_of(options, has_window);
  if (!options.overlay_csv.empty()) csv_.emplace(options.overlay_csv);
  if (options.replay) replay_.emplace(*options.replay);
  if (!options.log.empty()) log_.open(options.log);
  if (has_window || replay_) simulation_.keep_moments();  // a log may go back to them
  if (has_window || !options.record.empty() || csv_) measure_copy_bandwidth();
  recorder_.set_seen(context.size_px());
  recorder_.begin(simulation);
  if (hooks.announce) {
    hooks.announce(fmt::format("drawing: {} ({}), draw target {}", context.info().renderer,
                               context.info().platform, describe(*target_)));
  }
}

int Stage::run() {
  record_.start_clock();
  while (!ended()) {
    times_ = {};
    size_ = context_.size_px();
    if (size_.width <= 0 || size_.height <= 0) {  // an iconified window has no size
      context_.poll_events();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      continue;
    }
    recorder_.set_seen(size_);
    commands_ = handle_input();
    if (commands_.quit) break;
    steer();
    const bool through_canvas = recorder_.wants_seen();
    if (through_canvas) canvas_.resize(size_.width, size_.height);
    const Viewport viewport = {through_canvas ? canvas_.framebuffer() : 0, size_, scale_};
    begin_steps();
    draw_air(viewport);  // queued behind the steps, so that a device has work while the host waits for them
    finish_steps();
    describe_overlay();
    draw_flight(viewport);
    draw_gui(viewport);
    take_frame(viewport);
    present(viewport);
    if (simulation_.view().frame_totals.num_steps > 0) {
      record_.add_frame(times_, simulation_.view().frame_totals, simulation_.view().dt_s, drawing_);
    }
    keep_pace();
    ++num_frames_;
  }
  return finish();
}

int Stage::finish() {
  recorder_.finish(simulation_);
  log_.close_all(simulation_);
  record_.set_part("record", recorder_.report());
  record_.set_part("display", {{"vsync", context_.window() != nullptr && vsync_},
                               {"content_scale", context_.content_scale()},
                               {"ui_scale", switches_.ui_scale},
                               {"width", size_.width},
                               {"height", size_.height}});
  record_.set_part("accuracy",
                   accuracy_.is_followed() ? to_json(accuracy_.readout()) : nlohmann::json(nullptr));
  record_.set_part("replay", replay_ ? replay_->report() : nlohmann::json(nullptr));
  if (replay_ && hooks_.announce) hooks_.announce(replay_->summary());
  const bool gave_up =
      context_.window() == nullptr && simulation_.view().paused && !replay_ && !options_.still_s;
  if (gave_up && hooks_.announce) hooks_.announce(simulation_.view().message);
  return gave_up || recorder_.failed() || (replay_ && replay_->diverged()) ? 1 : 0;
}

// A log's inputs instead of a person's; the last frame before a still shortened so that it ends there.
void Stage::steer() {
  if (replay_) {
    const bool quit = commands_.quit;
    commands_ = replay_->commands(simulation_.settings());
    commands_.quit = quit;
  }
  if (!options_.still_s) return;
  const Settings& settings = simulation_.settings();
  const double left_s = left_to_still_s();
  if (left_s <= 0.0) {
    commands_.toggle_pause = !simulation_.view().paused;  // T = 0: the start is drawn, without a step
  } else if (left_s < settings.time_scale / settings.frame_rate_hz) {
    commands_.settings = settings;
    commands_.settings->time_scale = left_s * settings.frame_rate_hz;
  }
}

// Simulated time from now to the still's. 0 once it is so short that no frame can be shortened to it.
double Stage::left_to_still_s() const {
  const double left_s = *options_.still_s - simulation_.view().simulated_s;
  static const double least = find_field("run.time_scale", "--still").min;
  return left_s * simulation_.settings().frame_rate_hz < least ? 0.0 : left_s;
}

bool Stage::ended() {
  if (stop_requested.load(std::memory_order_relaxed) || context_.close_asked()) return true;
  if (replay_) return replay_->ended();
  if (options_.still_s) return still_ended();
  const Settings& settings = simulation_.settings();
  const double shown_s = static_cast<double>(num_frames_) / settings.frame_rate_hz;
  // A scene's own length is that of a headless run: a window stays until it is closed, or as long as asked.
  const bool has_end = settings.seconds > 0.0 && (context_.window() == nullptr || options_.seconds_given);
  if (has_end && shown_s >= settings.seconds - 1e-9) return true;
  if (context_.window() != nullptr) return false;
  if (simulation_.view().paused) return true;  // by itself: nobody is there to press a key
  if (settings.seconds > 0.0) return false;
  if (simulation_.finished_flight()) ++frames_after_flight_;
  const double after_s = static_cast<double>(frames_after_flight_) / settings.frame_rate_hz;
  return after_s >= kAfterFlight_s || shown_s >= kLongestFilm_s;
}

bool Stage::still_ended() const {
  const FrameView& view = simulation_.view();
  if (num_frames_ > 0 && left_to_still_s() == 0.0) return true;
  const bool stands = view.paused || (view.flight == Flight::landed && !simulation_.settings().relaunch);
  if (!stands) return false;
  throw UserError(fmt::format("--still: the flight ends at {} s of simulated time{}{}; give an earlier time",
                              view.simulated_s, view.message.empty() ? "" : ": ", view.message));
}

// Keys, mouse and panel; the overlay is described after the simulation has moved on.
Commands Stage::handle_input() {
  ScopedPhase timing(times_, Phase::panel);
  context_.poll_events();
  gui_.set_look(switches_.look.theme, scale_);
  gui_.begin_frame(size_, frame_s_);
  InputFrame input;
  if (input_) input = input_->take(gui_);
  Commands commands = panel_.edit(simulation_.view(), switches_, scale_);
  if (num_frames_ == 0) commands.toggle_pause = commands.toggle_pause != (options_.paused && input_);
  commands.toggle_pause = commands.toggle_pause != input.commands.toggle_pause;
  commands.single_step = commands.single_step || input.commands.single_step;
  commands.reset = commands.reset || input.commands.reset;
  commands.launch = commands.launch || input.commands.launch;
  commands.back = commands.back || input.commands.back;
  commands.time_scale_factor = input.commands.time_scale_factor;
  if (input.commands.compare != Comparison::none) commands.compare = input.commands.compare;
  commands.quit = input.commands.quit;
  // S steps while paused; while running it does nothing.
  commands.single_step = commands.single_step && simulation_.view().paused;
  write_panel_map();
  aim(input, commands);
  follow_keys(input);
  follow_switches(commands);
  follow_camera(input);
  return commands;
}

// The ball is grabbed where it is, or at its start, and the show waits until it is let go.
void Stage::aim(const InputFrame& input, Commands& commands) {
  const FrameView& view = simulation_.view();
  const Settings& settings = *view.settings;
  if (!aim_.active() && input.pressed_left && view.physics->ball.present && is_at_ball(input.pointer_px))
    aim_.begin({{settings.ball_vx_mps, settings.ball_vy_mps}, settings.ball_spin_radps}, scale_);
  if (!aim_.active()) return;
  aim_.drag(input.drag_px, input.shift);
  commands.hold = true;
  if (commands.quit) aim_.cancel();
  commands.quit = false;
  if (input.released) commands.fly = aim_.release();
  Settings aimed = settings;
  aimed.ball_vx_mps = aim_.launch().velocity_mps.x;
  aimed.ball_vy_mps = aim_.launch().velocity_mps.y;
  aimed.ball_spin_radps = aim_.launch().spin_radps;
  aimed_ghosts_ = ghosts_of(aimed);
}

bool Stage::is_at_ball(Vec2d pointer_px) const {
  const FrameView& view = simulation_.view();
  constexpr double kLeastReach_px = 14.0;
  const double reach_m =
      std::max(view.physics->ball.radius_m, kLeastReach_px * scale_ * camera_.metres_per_px);
  const Vec2d pointer_m = camera_.to_world(pointer_px);
  const auto is_near = [&](Vec2d place_m) {
    const Vec2d away = pointer_m - place_m;
    return dot(away, away) <= reach_m * reach_m;
  };
  return is_near(view.ball.position_m) || is_near({view.settings->ball_x_m, view.settings->ball_y_m});
}

void Stage::follow_keys(const InputFrame& input) {
  if (input.toggle_panel) switches_.show_panel = !switches_.show_panel;
  if (input.toggle_path) switches_.show_path = !switches_.show_path;
  if (input.next_overlay) switches_.overlay_mode = (switches_.overlay_mode + 1) % kNumOverlayModes;
  Look& look = switches_.look;
  if (input.toggle_ghosts) look.ghosts = !look.ghosts;
  if (input.next_theme) look.theme = look.theme == Theme::dark ? Theme::light : Theme::dark;
  if (input.next_color_map) {
    const auto next = (static_cast<std::size_t>(look.color_map) + 1) % kColorMapNames.size();
    look.color_map = static_cast<ColorMap>(next);
  }
  if (input.toggle_vsync) switches_.vsync = !switches_.vsync;
  if (input.toggle_full_screen) switches_.full_screen = !switches_.full_screen;
  if (input.larger_text != 0) switches_.ui_scale = scaled_text(switches_.ui_scale, input.larger_text);
  // Ghosts are paths; asked for, they are shown.
  if (input.toggle_ghosts && look.ghosts) switches_.show_path = true;
}

void Stage::follow_switches(const Commands& commands) {
  // What is launched by hand or compared is to be seen.
  if (commands.fly || commands.compare != Comparison::none) switches_.show_path = true;
  switches_.look.paths = switches_.show_path;
  scale_ = context_.content_scale() * static_cast<float>(switches_.ui_scale);  // from the next frame on
  if (switches_.vsync != vsync_) context_.set_vsync(switches_.vsync);
  vsync_ = switches_.vsync;
  overlay_.set_vsync(context_.window() != nullptr && vsync_);
  context_.set_full_screen(switches_.full_screen);
}

void Stage::follow_camera(const InputFrame& input) {
  if (!aim_.active() && (input.drag_px.x != 0.0 || input.drag_px.y != 0.0)) camera_.pan(input.drag_px);
  const World& world = simulation_.view().physics->world;
  const Vec2d half_m = to_metres(world, world.half);
  if (input.zoom != 1.0) camera_.zoom_at(input.pointer_px, input.zoom, 2.0 * std::max(half_m.x, half_m.y));
  if (input.fit || switches_.fit_camera) camera_.fitted = true;
  switches_.fit_camera = false;
  if (camera_.fitted) fit_camera();
  if (input.toggle_film) recorder_.toggle(simulation_);
  if (input.take_picture) recorder_.ask_picture();
}

// Once per backend: what the share of the copying speed is of. Without it the share is left out.
void Stage::measure_copy_bandwidth() {
  Backend& backend = simulation_.backend();
  const std::size_t num_bytes = backend.name() == "cuda" ? 256U << 20 : 32U << 20;  // beyond the caches
  try {
    overlay_.set_copy_bandwidth(backend.measure_copy_bandwidth(num_bytes));
  } catch (const DeviceError&) {  // no room for the copy
    overlay_.set_copy_bandwidth(0.0);
  } catch (const std::bad_alloc&) {
    overlay_.set_copy_bandwidth(0.0);
  }
}

// Without an overlay there is no legend either: the scene alone.
Look Stage::look_of_marks() const {
  Look look = switches_.look;
  look.paths = look.paths && static_cast<OverlayMode>(switches_.overlay_mode) != OverlayMode::off;
  return look;
}

ViewRegion Stage::free_region() const {
  const double left = switches_.show_panel ? panel_.width_px(scale_) : 0.0;
  const OverlayMode mode = Overlay::fitting_mode(static_cast<OverlayMode>(switches_.overlay_mode),
                                                 static_cast<float>(size_.width - left), scale_);
  const double bottom = overlay_.used_height_px(mode, scale_);
  const double top = SceneMarks::reserved_px(simulation_.view(), look_of_marks(), scale_,
                                             static_cast<float>(size_.height - bottom));
  return {left, bottom, std::max(size_.width - left, 1.0), std::max(size_.height - bottom - top, 1.0)};
}

void Stage::fit_camera() { fit_world(camera_, simulation_.view().physics->world, free_region(), scale_); }

void Stage::begin_steps() {
  const int num_fallbacks = simulation_.num_fallbacks();
  const std::int64_t num_scenes = simulation_.view().num_scenes;
  log_.begin_frame(commands_, simulation_);
  simulation_.begin_frame(commands_, target_.get());
  if (simulation_.num_fallbacks() != num_fallbacks) follow_fallback();
  if (simulation_.view().num_scenes != num_scenes) begin_record();
}

void Stage::finish_steps() {
  const int num_fallbacks = simulation_.num_fallbacks();
  simulation_.finish_frame();
  log_.end_frame(simulation_);
  if (replay_) replay_->end_frame(simulation_);
  if (simulation_.num_fallbacks() != num_fallbacks) follow_fallback();
  times_ += simulation_.view().times;
  follow_accuracy();
}

// Measuring belongs to what shows it.
void Stage::follow_accuracy() {
  ScopedPhase timing(times_, Phase::panel);
  if (panel_.shows_accuracy()) {
    accuracy_.follow(simulation_.view(), simulation_.backend());
  } else {
    accuracy_.forget();
  }
  panel_.set_readout(accuracy_.is_followed() ? &accuracy_.readout() : nullptr);
}

// The report is about the scene that the run ends with.
void Stage::begin_record() {
  Backend& backend = simulation_.backend();
  record_ =
      RunRecord(simulation_.settings(), *simulation_.view().physics, backend.measure(), backend.device());
  record_.start_clock();
}

void Stage::follow_fallback() {
  target_ = make_draw_target(hooks_, simulation_.backend().name());
  overlay_.set_draw_target(describe(*target_));
  panel_.set_draw_target(describe(*target_));
  measure_copy_bandwidth();
  if (hooks_.announce)
    hooks_.announce(fmt::format("{} Draw target {}", simulation_.view().message, describe(*target_)));
}

void Stage::describe_overlay() {
  ScopedPhase timing(times_, Phase::panel);
  OverlayPlace place;
  place.left_px = switches_.show_panel ? panel_.width_px(scale_) : 0.0F;
  place.width_px = static_cast<float>(size_.width) - place.left_px;
  place.bottom_px = static_cast<float>(size_.height);
  place.scale = scale_;
  const FrameView& view = simulation_.view();
  const auto mode = static_cast<OverlayMode>(switches_.overlay_mode);
  overlay_.show(view, mode, place, switches_.look);
  place.bottom_px -= Overlay::height_px(Overlay::fitting_mode(mode, place.width_px, scale_), scale_);
  const auto height_px = static_cast<float>(size_.height);
  marks_.show(view, camera_, place, height_px, look_of_marks());
  if (aim_.active()) {
    SceneMarks::show_aim(aim_.launch(), initial_ball(*view.settings).position_m, view.physics->ball.radius_m,
                         camera_, place, height_px, switches_.look);
  }
  if (context_.window() != nullptr) show_recording();
  gui_.end_frame();
}

// At the upper right corner of the window; a film that is drawn for itself does not have it.
void Stage::show_recording() {
  const std::string text = recorder_.notice();
  if (!text.empty()) show_corner_notice(text, static_cast<float>(size_.width), scale_);
}

void Stage::draw_air(const Viewport& viewport) {
  const Clock::time_point start = Clock::now();
  const ParcelBuffers parcels = target_->buffers();
  renderer_.set_look(switches_.look);
  air_timer_.begin();
  renderer_.draw_air(simulation_.view(), &parcels, camera_, viewport);
  air_timer_.end();
  const double film_before_ms = times_[Phase::encode];
  if (FilmScene* film = recorder_.scene()) {
    ScopedPhase timing(times_, Phase::encode);
    film->set_look(switches_.look);
    film->draw_air(simulation_.view(), parcels, camera_, free_region(),
                   recorder_.has_overlay() ? &overlay_ : nullptr);
  }
  target_->frame_drawn();
  settle();
  draw_air_ms_ = milliseconds_since(start) - (times_[Phase::encode] - film_before_ms);
}

void Stage::draw_flight(const Viewport& viewport) {
  const Clock::time_point start = Clock::now();
  flight_timer_.begin();
  if (aim_.active()) {
    FrameView aimed = simulation_.view();
    aimed.ball = initial_ball(*aimed.settings);
    aimed.ghosts = &aimed_ghosts_;
    renderer_.set_look({switches_.look.theme, switches_.look.color_map, true, true});
    renderer_.draw_flight(aimed, camera_, viewport);
  } else {
    renderer_.draw_flight(simulation_.view(), camera_, viewport);
  }
  flight_timer_.end();
  settle();
  drawing_.host_draw_ms = draw_air_ms_ + milliseconds_since(start);
  drawing_.gpu_draw_ms = air_timer_.newest_ms() + flight_timer_.newest_ms();
  // A GPU works on after the calls return.
  times_[Phase::draw] = context_.info().software ? drawing_.host_draw_ms
                                                 : std::fmax(drawing_.gpu_draw_ms, drawing_.host_draw_ms);
}

void Stage::draw_gui(const Viewport& viewport) {
  {
    ScopedPhase timing(times_, Phase::panel);
    panel_timer_.begin();
    gui_.draw(viewport.framebuffer, viewport.size);
    panel_timer_.end();
    settle();
  }
  drawing_.host_panel_ms = times_[Phase::panel];
  drawing_.gpu_panel_ms = panel_timer_.newest_ms();
}

void Stage::take_frame(const Viewport& viewport) {
  ScopedPhase timing(times_, Phase::encode);
  if (FilmScene* film = recorder_.scene()) {
    film->draw_rest(simulation_.view(), recorder_.has_overlay() ? &overlay_ : nullptr, gui_);
    settle();
  }
  recorder_.take({viewport.framebuffer, viewport.size}, simulation_);
}

void Stage::present(const Viewport& viewport) {
  ScopedPhase timing(times_, Phase::present);
  if (context_.window() != nullptr && viewport.framebuffer != 0) {
    // Mesa looks for a new window size when a viewport is set, not when something is copied there.
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, viewport.size.width, viewport.size.height);
    const auto [width, height] = viewport.size;
    glBlitNamedFramebuffer(viewport.framebuffer, 0, 0, 0, width, height, 0, 0, width, height,
                           GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
  context_.present();
}

void Stage::write_panel_map() {
  if (hooks_.panel_map.empty()) return;
  if (simulation_.view().physics->ball.present) {
    const Vec2d start_px =
        (initial_ball(simulation_.settings()).position_m - camera_.center_m) * (1.0 / camera_.metres_per_px) +
        camera_.anchor_px;
    const auto x = static_cast<float>(start_px.x);
    const auto y = static_cast<float>(size_.height - start_px.y);
    panel_.controls().note("Ball's start", {x - 1.0F, y - 1.0F, x + 1.0F, y + 1.0F});
  }
  std::string layout = panel_.controls().text();
  if (layout == panel_layout_) return;
  panel_layout_ = std::move(layout);
  panel_.controls().write(hooks_.panel_map);
}

// A window shows frames at the rate that the time scale is meant for, also on a faster screen.
void Stage::keep_pace() {
  const Clock::time_point now = Clock::now();
  frame_s_ = std::chrono::duration<double>(now - last_frame_).count();
  last_frame_ = now;
  overlay_.add_frame(times_, 1e3 * frame_s_, simulation_.view(), drawing_);
  if (csv_) {
    csv_->add_line(times_, drawing_, 1e3 * frame_s_, simulation_.view(),
                   overlay_.history().figures(overlay_.info().copy_bytes_per_s), overlay_.info());
  }
  if (context_.window() == nullptr) return;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(1.0 / simulation_.settings().frame_rate_hz));
  next_frame_ = std::max(next_frame_ + period, now - period);
  // Two milliseconds are left to the screen's own pace.
  const Clock::time_point wake = next_frame_ - std::chrono::milliseconds(2);
  if (wake > now) std::this_thread::sleep_until(wake);
}

// A rasteriser on the CPU starts when something waits for it. Waiting here books its time where it belongs.
void Stage::settle() const {
  if (context_.info().software) glFinish();
}

}  // namespace

std::unique_ptr<GlContext> open_stage_context(const Options& options, const StageHooks& hooks) {
  ContextRequest request;
  request.width_px = options.width_px;
  request.height_px = options.height_px;
  request.vsync = options.vsync;
  if (options.headless) return open_offscreen(request);
  if (display_available()) return open_window(request);
  if (hooks.announce) hooks.announce("no display (DISPLAY, WAYLAND_DISPLAY): running without a window");
  return open_offscreen(request);
}

int run_stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
              const StageHooks& hooks) {
  return Stage(options, context, simulation, record, hooks).run();
}

}  // namespace pf
