#include "view/stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "app/command_queue.hpp"
#include "core/error.hpp"
#include "view/host_draw_target.hpp"
#include "view/stage_loop.hpp"
#include "view/stage_start.hpp"

namespace pf {
namespace {

std::unique_ptr<GlDrawTarget> make_draw_target(const StageHooks& hooks, Backend& backend) {
  if (hooks.make_draw_target) return hooks.make_draw_target(backend);
  return std::make_unique<HostDrawTarget>("CPU backend");
}

SplitMode split_mode(const Options& options) {
  return index_of<SplitMode>(options.split_view, kSplitViewNames);
}

ViewSwitches switches_of(const Options& options, bool window) {
  ViewSwitches switches;
  switches.show_panel = window ? options.show_panel : options.record_panel;
  switches.show_path = options.show_path || options.ghosts;
  switches.overlay_mode = index_of<int>(options.overlay, kOverlayNames);
  // Without a window the picture is the film.
  if (!window && !options.record_overlay) switches.overlay_mode = static_cast<int>(OverlayMode::off);
  switches.look.theme = index_of<Theme>(options.theme, kThemeNames);
  switches.look.color_map = index_of<ColorMap>(options.color_map, kColorMapNames);
  switches.look.ghosts = options.ghosts;
  switches.ui_scale = options.ui_scale;
  switches.vsync = options.vsync;
  switches.full_screen = options.full_screen && window;
  if (!options.split.empty()) switches.split.difference = options.split;
  if (!options.split.empty()) switches.split.mode = split_mode(options);
  return switches;
}

MakeBackend backend_of_second(const Options& options, const StageHooks& hooks) {
  if (!hooks.make_backend) return nullptr;
  return [&options, &hooks](const std::string& name, std::int64_t threads) {
    const std::string obstacle = obstacle_to_split(options);
    if (!obstacle.empty()) throw UserError(obstacle);
    return hooks.make_backend(name, threads);
  };
}

std::string describe(const GlDrawTarget& target) {
  return fmt::format("{}: {}", kDrawTargetNames[static_cast<int>(target.kind())], target.reason());
}

}  // namespace

Stage::Stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
             const StageHooks& hooks)
    : options_(options),
      context_(context),
      simulation_(simulation),
      record_(record),
      hooks_(hooks),
      pair_(simulation, backend_of_second(options, hooks)),
      split_(pair_, split_mode(options),
             [&hooks](Backend& backend) { return make_draw_target(hooks, backend); }),
      target_(make_draw_target(hooks, simulation.backend())),
      input_(context.window() == nullptr ? nullptr : std::make_unique<WindowInput>(context.window())),
      gui_(context),
      panel_(hooks.max_parcels, describe(*target_), context.info().renderer),
      term_costs_(hooks.make_backend),
      overlay_({describe(*target_)}, context.window() == nullptr && options.bench_frames == 0),
      cues_(context.window() != nullptr),
      log_(simulation, simulation.backend().name(), options.data.from, options.data.from_frame),
      recorder_(options, context.window() != nullptr, hooks.announce, log_),
      last_seconds_(options.clip_s),
      files_(options.data, context.window() != nullptr && !options.replay, hooks.announce),
      air_timer_(context.info().software),
      flight_timer_(context.info().software),
      panel_timer_(context.info().software),
      scale_(context.content_scale() * static_cast<float>(options.ui_scale)),
      vsync_(options.vsync) {
  const bool has_window = context.window() != nullptr;
  switches_ = switches_of(options, has_window);
  log_.set_pair(&pair_);
  if (options.replay) pair_.follow_log();
  if (options.cues) cues_.load(*options.cues, 0);
  panel_.set_cues(&cues_);
  if (!options.overlay_csv.empty()) csv_.emplace(options.overlay_csv);
  if (!options.profile_csv.empty()) profile_csv_.emplace(options.profile_csv);
  if (options.replay) replay_.emplace(*options.replay);
  if (options.data.start) {
    first_frame_ = num_frames_ = num_whole_frames_ = num_scene_frames_ = options.data.start->num_frames;
    frames_after_flight_ = options.data.start->frames_after_flight;
  }
  if (!options.log.empty()) log_.open(options.log);
  if (has_window && !replay_) pair_.keep_to_budget();
  if (has_window || replay_) pair_.keep_checkpoints();  // a log may go back to them
  if (has_window || !options.record.empty() || csv_) measure_copy_bandwidth();
  if (options.keep_clip || !context.info().software) last_seconds_.switch_on();
  recorder_.set_seen(context.size_px());
  recorder_.begin(simulation);
  if (!has_window && hooks.announce && options.bench_frames == 0) progress_.emplace(1.0, 0.25);
  if (hooks.announce) {
    hooks.announce(fmt::format("drawing: {} ({}), draw target {}", context.info().renderer,
                               context.info().platform, describe(*target_)));
  }
}

int Stage::run() {
  files_.follow(simulation_, clock());
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
    const Viewport viewport = through_canvas
                                  ? Viewport{canvas_.framebuffer(), canvas_.texture(), size_, scale_}
                                  : Viewport{0, 0, size_, scale_};
    begin_steps();
    follow_ball();
    draw_air(viewport);  // queued behind the steps, so that a device has work while the host waits for them
    finish_steps();
    describe_overlay();
    draw_flight(viewport);
    draw_gui(viewport);
    take_frame(viewport);
    present(viewport);
    if (simulation_.view().times.step_ms() > 0.0) {
      record_.add_frame(times_, simulation_.view().frame_totals, simulation_.view().dt_s, drawing_);
    } else {
      record_.pass_idle_time();
    }
    keep_pace();
    ++num_frames_;
    if (pair_.is_whole()) ++num_whole_frames_;
    if (context_.window() == nullptr || is_frame_flown()) ++num_scene_frames_;
    files_.follow(simulation_, clock());
    say_if_slowed();
    show_progress();
  }
  return finish();
}

// Takes the inputs of a log instead of a person's, and shortens the last frame before a still so that it ends
// there.
void Stage::steer() {
  if (replay_) {
    const bool quit = commands_.quit;
    if (changes_anything(commands_)) tell_of_replay();
    commands_ = replay_->commands(simulation_.settings());
    commands_.quit = quit;
  }
  if (options_.still_s) steer_to_still();
}

bool Stage::ended() {
  was_interrupted_ = stop_requested.load(std::memory_order_relaxed);
  const bool is_stopped = was_interrupted_ || context_.close_requested();
  if (is_stopped && options_.still_s) refuse_still_before_its_time();
  if (is_stopped) return true;
  if (replay_) return replay_->ended();
  if (options_.still_s) return still_ended();
  return scene_ended() && !goes_on_to_next_cue();
}

bool Stage::scene_ended() {
  const Settings& settings = simulation_.settings();
  const double shown_s = static_cast<double>(num_whole_frames_ - cue_frame_) / settings.frame_rate_hz;
  // A scene's own length is for headless runs. A window stays until it is closed, or for --seconds.
  const bool has_end = settings.seconds > 0.0 && (context_.window() == nullptr || options_.seconds_given);
  if (has_end && shown_s >= settings.seconds - 1e-9) return true;
  if (context_.window() != nullptr) return false;
  if (simulation_.view().paused) return true;  // the simulation paused itself, and there are no keys
  if (settings.seconds > 0.0) return false;
  if (pair_.finished_flights()) ++frames_after_flight_;
  const double after_s = static_cast<double>(frames_after_flight_) / settings.frame_rate_hz;
  if (after_s >= kAfterFlight_s) return true;
  if (shown_s < kLongestFilm_s) return false;
  if (hooks_.announce)
    hooks_.announce(
        fmt::format("run.seconds: no ball has left in {} s; give --seconds for a longer run", shown_s));
  return true;
}

void Stage::begin_steps() {
  int num_fallbacks = simulation_.num_fallbacks();
  const std::int64_t num_scenes = simulation_.view().num_scenes;
  const std::int64_t num_begun = pair_.num_begun();
  commands_ = pair_.admit(commands_);
  if (simulation_.num_fallbacks() != num_fallbacks) follow_fallback();  // else the CPU would draw on the GPU
  num_fallbacks = simulation_.num_fallbacks();
  follow_split(num_begun);
  if (pair_.first_goes()) log_.begin_frame(commands_, simulation_);
  pair_.begin(commands_, target_.get(), split_.target());
  say_what_was_done();
  if (simulation_.num_fallbacks() != num_fallbacks) follow_fallback();
  const bool is_new_scene = simulation_.view().num_scenes != num_scenes;
  const bool begins_again = pair_.num_begun() != num_begun && commands_.hold;  // else it has just begun
  if (is_new_scene || begins_again) begin_record();
  if (is_new_scene) num_scene_frames_ = 0;
  follow_cues(is_new_scene);
}

// A jump back that was refused has its reason as message.
void Stage::say_what_was_done() {
  const FrameView& view = simulation_.view();
  const double now_s = view.history->time_at(view.history->position());
  if (commands_.back && view.message.empty())
    notice_.show(fmt::format("Back to {:.2f} s", view.sought_s.value_or(now_s)), Clock::now());
}

void Stage::finish_steps() {
  const int num_fallbacks = simulation_.num_fallbacks();
  pair_.finish();
  title_.advance(title_step_s());
  if (pair_.first_goes()) log_.end_frame(simulation_);
  if (replay_) replay_->end_frame(simulation_, pair_.second());
  if (simulation_.num_fallbacks() != num_fallbacks) follow_fallback();
  times_ += simulation_.view().times;
  follow_accuracy();
  follow_terms();
}

// The report covers the scene that the run ends with.
void Stage::begin_record() {
  Backend& backend = simulation_.backend();
  record_ = RunRecord(*simulation_.view().physics, backend.measure(), backend.device());
  record_.set_warmup(options_.warmup_frames);
  record_.start_clock();
}

RunClock Stage::clock() const { return {record_.initial(), num_scene_frames_, frames_after_flight_}; }

// The picture is the last one of a frame, and that had steps.
bool Stage::is_frame_flown() const {
  return pair_.is_whole() && simulation_.view().frame_totals.num_steps > 0;
}

// The scene starts anew on the other backend.
void Stage::follow_fallback() {
  begin_record();
  target_ = make_draw_target(hooks_, simulation_.backend());
  overlay_.set_draw_target(describe(*target_));
  panel_.set_draw_target(describe(*target_));
  panel_.set_max_parcels(StageHooks{}.max_parcels);
  measure_copy_bandwidth();
  if (hooks_.announce)
    hooks_.announce(fmt::format("{} Draw target {}", simulation_.view().message, describe(*target_)));
}

// A window keeps the scene's frame rate also on a faster screen, because the time scale refers to it.
void Stage::keep_pace() {
  const Clock::time_point now = Clock::now();
  frame_s_ = std::chrono::duration<double>(now - last_frame_).count();
  last_frame_ = now;
  overlay_.add_frame(times_, 1e3 * frame_s_, simulation_.view(), drawing_);
  if (csv_) {
    csv_->add_line(times_, drawing_, 1e3 * frame_s_, simulation_.view(),
                   overlay_.history().figures(overlay_.info().copy_bytes_per_s), overlay_.info());
  }
  if (profile_csv_ && (num_frames_ == first_frame_ || is_frame_flown()))
    profile_csv_->add_frame(simulation_.view());
  if (context_.window() == nullptr) return;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(1.0 / simulation_.settings().frame_rate_hz));
  next_frame_ = std::max(next_frame_ + period, now - period);
  // Two milliseconds are left to the screen's own pace.
  const Clock::time_point wake = next_frame_ - std::chrono::milliseconds(2);
  if (wake > now) std::this_thread::sleep_until(wake);
}

std::unique_ptr<GlContext> open_stage_context(const Options& options, const StageHooks& hooks) {
  ContextRequest request;
  request.width_px = options.width_px;
  request.height_px = options.height_px;
  request.vsync = options.vsync;
  if (!options.headless && display_available()) return open_window(request);
  if (!options.headless && hooks.announce)
    hooks.announce(no_display_text() + ": running without a window" +
                   (options.record.empty() ? "; for a film give --record FILE.mp4" : ""));
  return open_offscreen(request);
}

int run_stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
              const StageHooks& hooks) {
  check_start(options, hooks, context.window() != nullptr, simulation);
  return Stage(options, context, simulation, record, hooks).run();
}

}  // namespace pf
