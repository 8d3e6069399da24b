// Cues of a talk and the undoing of changes, as the stage carries them out.
#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "view/stage_loop.hpp"

namespace pf {
namespace {

constexpr double kFailure_s = 12.0;  // long enough to read a line of an error

}  // namespace

void Stage::tell_of_replay() {
  notice_.show("A replay takes its inputs from the log, and ends with it; yours change the view",
               Clock::now());
}

void Stage::load_cues(const std::string& name_or_path) {
  if (replay_) return tell_of_replay();
  try {
    cues_.load(load_cue_list(name_or_path), CuePlayer::kNone);
    tell_if_no_such_cue(cues_.ask(0));
  } catch (const UserError& error) {
    notice_.show(error.what(), Clock::now(), kFailure_s);
  }
}

void Stage::follow_cue_keys(const InputFrame& input, Commands& commands) {
  follow_cue_panel();
  if (replay_) {
    if (input.go_to_cue != 0 || input.next_cue != 0) tell_of_replay();
    return;
  }
  if (input.go_to_cue != 0) tell_if_no_such_cue(cues_.ask(input.go_to_cue - 1));
  if (input.next_cue != 0) tell_if_no_such_cue(cues_.ask_next(input.next_cue));
  cues_.add_commands(commands, pair_.view());
}

void Stage::follow_cue_panel() {
  const CueRequest request = panel_.take_cue_request();
  if (replay_ && request.go_to != CuePlayer::kNone) return tell_of_replay();
  if (request.go_to != CuePlayer::kNone) tell_if_no_such_cue(cues_.ask(request.go_to));
  if (!request.load.empty()) load_cues(request.load);
  if (!request.save_to.empty()) save_cue(request);
}

void Stage::tell_if_no_such_cue(bool is_there) {
  if (is_there) return;
  notice_.show(cues_.size() == 0
                   ? "There are no cues: start with --cues FILE.toml, or load a list in the panel"
                   : fmt::format("There is no such cue: the list has {}", cues_.size()),
               Clock::now());
}

// The present settings and view; the middle and width are those of the part that panel and overlay leave
// free.
Cue Stage::present_cue() {
  Cue cue;
  cue.settings = simulation_.settings();
  cue.paused = simulation_.view().paused;
  cue.settings.follow_ball = switches_.follow_ball;
  cue.settings.magnifier = switches_.magnifier;
  if (camera_.fitted || ball_camera_.is_on()) return cue;
  const ViewRegion free = free_region();
  cue.camera = {camera_.to_world(free.center_px()), free.width_px * camera_.metres_per_px};
  return cue;
}

void Stage::save_cue(const CueRequest& request) {
  try {
    const std::filesystem::path file = with_toml_ending(request.save_to);
    Cue cue = present_cue();
    cue.title = request.title.empty() ? cue.settings.name : request.title;
    append_cue(file, cue, simulation_.backend().name());
    CueList saved = load_cue_list(file.string());
    const int added = static_cast<int>(saved.cues.size()) - 1;
    notice_.show(fmt::format("Saved as cue {} of {}", added + 1, file.string()), Clock::now());
    std::error_code ignored;
    const bool is_of_talk = std::filesystem::equivalent(file, cues_.list().file, ignored);
    if (cues_.size() > 0 && !is_of_talk) return;       // the talk goes on with its own
    CueList list = is_of_talk ? cues_.list() : saved;  // its cues have what the command line set
    if (is_of_talk) list.cues.push_back(saved.cues.back());
    const int last = static_cast<int>(list.cues.size()) - 1;
    cues_.replace(std::move(list), last);
  } catch (const UserError& error) {
    notice_.show(error.what(), Clock::now(), kFailure_s);
  }
}

// Ctrl+Z and Ctrl+Y.
void Stage::undo_or_redo(const InputFrame& input, Commands& commands) {
  if (input.undo == input.redo) return;
  if (replay_) return tell_of_replay();
  const FrameView view = pair_.view();
  if (view.sought_s)
    return notice_.show("The flight is on its way to another moment; take changes back there", Clock::now());
  const std::string line = input.undo ? history_.undo(commands, view) : history_.redo(commands, view);
  if (!line.empty()) notice_.show(line, Clock::now(), 2.0 * kNotice_s);
}

// After the commands of a frame.
void Stage::follow_cues(bool is_new_scene) {
  const FrameView view = pair_.view();
  const bool was_asked = cues_.is_asked();
  if (is_new_scene) title_.clear();
  if (cues_.follow(view)) {
    begin_cue();
  } else {
    if (was_asked && !cues_.is_asked()) cue_failed_ = context_.window() == nullptr;
    if (is_new_scene) cues_.mark(CuePlayer::kNone);  // from the menu, a file or an undo
  }
  history_.follow(view, simulation_.num_fallbacks(), gesture_, cues_.current());
  panel_.set_scene_settings(history_.scene_settings());
  if (const std::optional<int> cue = history_.take_cue()) {
    cues_.mark(*cue);
    take_camera(cues_.current_cue());
  }
}

// null: all of the world is shown.
void Stage::take_camera(const Cue* cue) {
  ball_camera_.stop(camera_, false);  // what it went back to was the camera before the cue
  camera_.shows_images = false;
  camera_.fitted = cue == nullptr || !cue->camera;
  if (camera_.fitted) return fit_camera();
  const ViewRegion free = free_region();
  camera_.center_m = cue->camera->center_m;
  camera_.anchor_px = free.center_px();
  camera_.metres_per_px = cue->camera->width_m / free.width_px;
}

void Stage::begin_cue() {
  const Cue& cue = *cues_.current_cue();
  title_.begin(cue);
  take_camera(&cue);
  if (context_.window() != nullptr || !hooks_.announce) return;
  hooks_.announce(fmt::format("cue {} of {}: {}", cues_.current() + 1, cues_.size(),
                              cue.title.empty() ? cue.settings.name : cue.title));
}

// A film of simulated time has a frame for each frame of the flight, however long that took.
double Stage::title_step_s() const {
  const bool by_frames =
      context_.window() == nullptr || (recorder_.is_recording() && !options_.record_real_time);
  if (!by_frames) return frame_s_;
  return !pair_.is_whole() ? 0.0 : 1.0 / simulation_.settings().frame_rate_hz;
}

// Without a window each cue flies as long as its scene would alone.
bool Stage::goes_on_to_next_cue() {
  const bool may_go_on = context_.window() == nullptr && !simulation_.view().paused && !cue_failed_;
  if (!may_go_on || cues_.size() == 0 || !cues_.ask_next(1)) return false;
  cue_frame_ = num_whole_frames_;
  frames_after_flight_ = 0;
  return true;
}

}  // namespace pf
