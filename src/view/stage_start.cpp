#include "view/stage_start.hpp"

#include <fmt/format.h>

#include <string>

#include "app/replay.hpp"
#include "app/run_state.hpp"
#include "core/error.hpp"

namespace pf {
namespace {

// Outputs that a run without a frame would leave empty.
bool wants_frames(const Options& options) {
  for (const std::filesystem::path& file : {options.record, options.overlay_csv, options.profile_csv,
                                            options.log, options.data.dump, options.picture})
    if (!file.empty()) return true;
  return false;
}

// Why a run that goes on from a state would end at once, as Stage::scene_ended() has it; empty: it goes on.
// Its length counts from the start of its scene; a window stays longer, unless --seconds is given.
std::string why_over(const Options& options, bool has_window, const RunState& start) {
  const double seconds = options.settings.seconds, rate_hz = options.settings.frame_rate_hz;
  const double shown_s = static_cast<double>(start.num_frames) / rate_hz;
  if (seconds > 0.0 && (!has_window || options.seconds_given) && shown_s >= seconds - 1e-9)
    return fmt::format("the run has lasted its {} s already; give a longer --seconds to go on", seconds);
  if (has_window) return "";
  if (start.paused)
    return "the flight stood still when this state was saved; give an earlier state, or take a window";
  const std::int64_t after_flight = start.frames_after_flight + (start.left_once ? 1 : 0);
  if (seconds <= 0.0 && static_cast<double>(after_flight) / rate_hz >= kAfterFlight_s)
    return "the run has ended with its flight; give --seconds to go on";
  if (seconds <= 0.0 && shown_s >= kLongestFilm_s)
    return fmt::format("no ball has left in {} s; give --seconds for a longer run", shown_s);
  return "";
}

void check_goes_on(const Options& options, const StageHooks& hooks, bool has_window) {
  const RunState* start = options.data.start.get();
  if (start == nullptr || options.replay || options.cues) return;
  if (options.still_s) {
    const bool stands = start->paused || (start->landed && !options.settings.relaunch);
    if (stands)
      throw UserError(
          fmt::format("--still: the flight ends at {} s of simulated time; give an earlier state or time",
                      start->simulated_s));
    return;
  }
  const std::string why = why_over(options, has_window, *start);
  if (why.empty()) return;
  if (wants_frames(options)) throw UserError("--from: " + why);
  const bool is_told_at_end = start->paused && !has_window;
  if (hooks.announce && !is_told_at_end) hooks.announce("--from: " + why);
}

}  // namespace

void check_start(const Options& options, const StageHooks& hooks, bool has_window, Simulation& simulation) {
  check_goes_on(options, hooks, has_window);
  if (options.replay) Replay(*options.replay).check_start(simulation);
  const double now_s = simulation.view().simulated_s;
  if (options.still_s && *options.still_s < now_s - 1e-9)
    throw UserError(
        fmt::format("--still: the run starts at {} s of simulated time; give a later time", now_s));
}

}  // namespace pf
