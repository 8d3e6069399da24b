// The end of a run: its files are completed, and the exit code is chosen.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "view/stage_loop.hpp"

namespace pf {

// A checkpoint is of a whole frame, to which log and report lead, too. Where the device fails, the other
// outputs come to their end before files_.finish() tells it.
void Stage::complete_frame() {
  if (options_.data.checkpoint.empty()) return;
  const int num_fallbacks = simulation_.num_fallbacks();
  while (simulation_.view().unfinished) {
    try {
      const Commands commands = simulation_.admit({});  // input that waited for the end of a step
      log_.begin_frame(commands, simulation_);
      simulation_.begin_frame(commands, nullptr);
      simulation_.finish_frame();
    } catch (const DeviceError&) {
      return;
    }
    if (simulation_.num_fallbacks() != num_fallbacks) return follow_fallback();
    log_.end_frame(simulation_);
    const FrameView& view = simulation_.view();
    record_.add_frame(view.times, view.frame_totals, view.dt_s, {});
  }
}

// An output that fails does not keep the others from their end.
int Stage::finish() {
  complete_frame();
  say_what_flew();
  recorder_.finish(simulation_, large_picture_scene());
  finish_last_seconds();
  log_.close_all(simulation_);
  const std::string lost_log = log_.take_failure();
  if (!lost_log.empty() && hooks_.announce) hooks_.announce(lost_log);
  files_.finish(simulation_, clock());
  record_.set_part("interrupted", was_interrupted_);
  record_.set_part("files", files_.report());
  const nlohmann::json split = pair_.report();
  say_what_second_flew(split);
  record_.set_part("split", split);
  record_.set_part("record", recorder_.report());
  record_.set_part("display", {{"vsync", context_.window() != nullptr && vsync_},
                               {"content_scale", context_.content_scale()},
                               {"ui_scale", switches_.ui_scale},
                               {"width", size_.width},
                               {"height", size_.height}});
  record_.set_part("chosen", to_json(options_.chosen));
  record_.set_part("accuracy",
                   accuracy_.is_followed() ? to_json(accuracy_.readout()) : nlohmann::json(nullptr));
  record_.set_part("terms", to_json(term_costs_));
  record_.set_part("replay", replay_ ? replay_->report() : nlohmann::json(nullptr));
  if (replay_ && hooks_.announce) hooks_.announce(replay_->summary());
  const bool stands_still =
      context_.window() == nullptr && simulation_.view().paused && !replay_ && !options_.still_s;
  if ((stands_still || cue_failed_) && hooks_.announce) hooks_.announce(reason_of_stop());
  const bool file_failed = recorder_.failed() || last_seconds_.failed() || log_.failed() || files_.failed();
  const bool failed = tables_broke_off() || stands_still || cue_failed_ || file_failed;
  return failed || (replay_ && replay_->diverged()) ? 1 : 0;
}

// A state that was saved in a pause has no message of its own.
std::string Stage::reason_of_stop() const {
  const std::string message = pair_.view().message;
  if (!message.empty()) return message;
  const bool was_paused = options_.data.start && options_.data.start->paused;
  if (!was_paused) return "The flight is paused, and without a window nothing starts it again";
  return "--from: the flight stood still when this state was saved, paused by hand or unable to go on; "
         "give an earlier state, or take a window, whose space bar starts it";
}

// Says which files of figures are not complete. Returns whether there are any.
bool Stage::tables_broke_off() {
  const auto check = [&](bool broke_off, const char* flag) {
    if (broke_off && hooks_.announce)
      hooks_.announce(
          fmt::format("{}: the file broke off: it could not be written; is the disk full?", flag));
    return broke_off;
  };
  const bool overlay = check(csv_ && csv_->broke_off(), "--overlay-csv");
  return check(profile_csv_ && profile_csv_->broke_off(), "--profile-csv") || overlay;
}

}  // namespace pf
