// Effects of keys, mouse and panel on the stage.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/command_queue.hpp"
#include "app/frame_names.hpp"
#include "view/escape.hpp"
#include "view/key_card.hpp"
#include "view/stage_loop.hpp"

namespace pf {
namespace {

// Steps of 2^(1/4) from 1, within the range of --ui-scale.
double scaled_text(double scale, int steps) {
  const double place = std::round(4.0 * std::log2(scale)) + steps;
  return std::clamp(std::exp2(0.25 * place), kMinUiScale, kMaxUiScale);
}

constexpr double kReachRadii = 2.0;  // of the ring: a press takes the ball

}  // namespace

// Keys, mouse and panel; the overlay follows after the steps.
Commands Stage::handle_input() {
  ScopedPhase timing(times_, Phase::panel);
  context_.poll_events();
  gui_.set_look(switches_.look.theme, scale_);
  gui_.begin_frame(size_, frame_s_);
  InputFrame input;
  if (input_) input = input_->take(gui_);
  split_.take_mouse(input, camera_, gui_, scale_);
  fold_panel();
  keep_view();
  Commands commands = panel_.edit(pair_.view(), switches_, scale_);
  split_.follow(input, switches_.split, commands);
  if (num_frames_ == first_frame_)
    commands.toggle_pause =
        commands.toggle_pause != (options_.paused && input_ && !simulation_.view().paused);
  commands = joined(std::move(commands), input.commands);
  if (commands.compare == Comparison::half_step && simulation_.view().half_step)
    commands.compare = Comparison::scene_step;
  if (input.is_new_gesture) ++gesture_;
  follow_cue_keys(input, commands);
  undo_or_redo(input, commands);
  show_keys(input);
  follow_timeline(commands);
  follow_last_seconds(input);
  take_dropped(input.dropped, commands);
  // S steps only while paused.
  commands.single_step = commands.single_step && simulation_.view().paused;
  write_panel_map();
  if (input.escape) escape(commands);
  aim(input, commands);
  offer_ball(input);
  follow_keys(input);
  follow_switches(commands);
  follow_camera(input);
  return commands;
}

// In a narrow window the panel is hidden until the window is wider, or H shows it.
void Stage::fold_panel() {
  const bool had_room = panel_.leaves_room();
  panel_.fit(static_cast<float>(size_.width), context_.content_scale());
  if (context_.window() == nullptr || options_.record_panel || panel_.leaves_room() == had_room) return;
  if (!had_room) {
    switches_.show_panel = switches_.show_panel || is_panel_folded_;
    is_panel_folded_ = false;
  } else if (switches_.show_panel) {
    switches_.show_panel = false;
    is_panel_folded_ = true;
    notice_.show("The window is narrow: H shows the panel", Clock::now());
  }
}

// The card of keys.
void Stage::show_keys(const InputFrame& input) {
  bool& shown = switches_.show_keys;
  if (input.toggle_keys) shown = !shown;
  if (!shown) return;
  show_key_card(place_of_overlay(), panel_.controls());
}

void Stage::escape(Commands& commands) {
  if (switches_.show_keys) {
    switches_.show_keys = false;
    return;
  }
  const Clock::time_point now = Clock::now();
  const std::string question = recorder_.is_recording() ? "Press Esc again to quit; the film will be finished"
                                                        : "Press Esc again to quit";
  const bool asked = notice_.text(now) == question;
  switch (effect_of_escape({gui_.has_popup(), aim_.active(), switches_.full_screen, asked})) {
    case EscapeEffect::close_popup:
      return gui_.close_popups();
    case EscapeEffect::stop_aiming:
      return aim_.cancel();
    case EscapeEffect::leave_full_screen:
      switches_.full_screen = false;
      return;
    case EscapeEffect::ask:
      return notice_.show(question, now);
    case EscapeEffect::quit:
      commands.quit = true;
  }
}

// A drag begins at the ball or at its start. The simulation waits until it ends.
void Stage::aim(const InputFrame& input, Commands& commands) {
  const FrameView& view = simulation_.view();
  const Settings& settings = *view.settings;
  const BallConstants& ball = view.physics->ball;
  const bool is_gone = view.num_scenes != aimed_scene_ || !ball.exists || ball.held;
  if (aim_.active() && is_gone) aim_.cancel();  // another scene has come
  if (!aim_.active() && input.pressed_left && ball_near(input.pointer_px, kReachRadii)) {
    aim_.begin({{settings.ball_vx_mps, settings.ball_vy_mps}, settings.ball_spin_radps}, scale_);
    aimed_scene_ = view.num_scenes;
    drag_is_aim_ = true;
  }
  if (!aim_.active()) return;
  aim_.drag(input.drag_px, input.shift);
  commands.hold = true;
  if (input.released) commands.fly = aim_.release();
  launched_by_hand_ = launched_by_hand_ || commands.fly;
  if (commands.fly && view.paused) commands.toggle_pause = true;  // a ball let go flies
  Settings aimed = settings;
  aimed.ball_vx_mps = aim_.launch().velocity_mps.x;
  aimed.ball_vy_mps = aim_.launch().velocity_mps.y;
  aimed.ball_spin_radps = aim_.launch().spin_radps;
  aimed_ghosts_ = ghosts_of(aimed);
}

double Stage::ring_px() const {
  return ring_radius_px(simulation_.view().physics->ball.radius_m / camera_.metres_per_px, scale_);
}

// The place of a ball that can fly, or of its start, if the pointer is within so many radii of its ring.
std::optional<Vec2d> Stage::ball_near(Vec2d pointer_px, double radii) const {
  const FrameView& view = simulation_.view();
  if (!view.physics->ball.exists || view.physics->ball.held) return std::nullopt;
  const double reach_m = radii * ring_px() * camera_.metres_per_px;
  const Vec2d pointer_m = camera_.to_world(pointer_px);
  for (const Vec2d place_m : {view.ball.position_m, initial_ball(*view.settings).position_m}) {
    const Vec2d away = pointer_m - place_m;
    if (dot(away, away) <= reach_m * reach_m) return place_m;
  }
  return std::nullopt;
}

// Shows by ring and cursor that the ball can be pulled.
void Stage::offer_ball(const InputFrame& input) {
  constexpr double kShownRadii = 5.0;
  ring_m_.reset();
  if (!input_ || gui_.wants_mouse() || input.drags_left) return;
  ring_m_ = ball_near(input.pointer_px, kShownRadii);
  if (ball_near(input.pointer_px, kReachRadii)) gui_.show_hand();
}

void Stage::follow_keys(const InputFrame& input) {
  if (input.toggle_panel) {
    switches_.show_panel = !switches_.show_panel;
    is_panel_folded_ = false;
  }
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
  if (input.measure_terms) switches_.measure_terms = true;
  // Ghosts are paths: switching them on shows paths.
  if (input.toggle_ghosts && look.ghosts) switches_.show_path = true;
}

void Stage::follow_switches(const Commands& commands) {
  // Shows the path of a launch by hand or a comparison.
  if (commands.fly || commands.compare != Comparison::none) switches_.show_path = true;
  switches_.look.paths = switches_.show_path;
  switches_.look.flight.reset();
  if (split_.is_on()) switches_.look.flight = split_colors(switches_.look.theme, pair_).first;
  scale_ = context_.content_scale() * static_cast<float>(switches_.ui_scale);  // from the next frame on
  if (switches_.vsync != vsync_) context_.set_vsync(switches_.vsync);
  vsync_ = switches_.vsync;
  overlay_.set_vsync(context_.window() != nullptr && vsync_);
  context_.set_full_screen(switches_.full_screen);
}

void Stage::follow_camera(const InputFrame& input) {
  follow_camera_keys(input);
  // A drag that has aimed pans nothing up to its end, also after Esc.
  if (!drag_is_aim_ && (input.drag_px.x != 0.0 || input.drag_px.y != 0.0)) pan(input.drag_px);
  if (input.released || !input.drags_left) drag_is_aim_ = false;
  if (input.zoom != 1.0) zoom(input);
  if (input.fit || switches_.fit_camera) {
    camera_.fitted = true;
    switches_.follow_ball = false;
  }
  switches_.fit_camera = false;
  fit_camera();
  if (input.toggle_film) recorder_.toggle(simulation_);
  if (input.take_picture) recorder_.request_picture();
  if (input.take_paths && split_.is_on()) {
    notice_.show("An SVG has one flight; X ends the second one, F12 takes both", Clock::now());
  } else if (input.take_paths) {
    recorder_.request_paths();
  }
}

void Stage::write_panel_map() {
  if (hooks_.panel_map.empty()) return;
  write_frame_count();
  if (simulation_.view().physics->ball.exists) {
    const Vec2d start_px = camera_.to_px(initial_ball(simulation_.settings()).position_m);
    const auto x = static_cast<float>(start_px.x);
    const auto y = static_cast<float>(size_.height - start_px.y);
    panel_.controls().note("Ball's start", {x - 1.0F, y - 1.0F, x + 1.0F, y + 1.0F});
  }
  marks_.note(panel_.controls());
  split_.note(panel_.controls(), static_cast<float>(size_.height));
  if (title_.opacity() > 0.0F)
    panel_.controls().note("Cue title: " + title_.title(),
                           {title_place_.x0, title_place_.y0, title_place_.x1, title_place_.y1});
  note_followed_ball();
  if (ring_m_) panel_.controls().note(launched_by_hand_ ? "Ring" : "Ring and hint", {});
  const std::string notice = notice_.text(Clock::now());
  if (!notice.empty()) panel_.controls().note("Notice: " + notice, {});
  std::string layout = panel_.controls().text();
  if (layout == panel_layout_) return;
  panel_layout_ = std::move(layout);
  panel_.controls().write(hooks_.panel_map);
}

// A test that presses keys reads in this file that a frame took them.
void Stage::write_frame_count() {
  if (!frame_count_.is_open()) frame_count_.open(frames_beside(hooks_.panel_map));
  frame_count_.seekp(0);
  frame_count_ << fmt::format("{:12}\n", ++num_mapped_frames_) << std::flush;
}

}  // namespace pf
