// Messages of a run without a window.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/split_setting.hpp"
#include "scene/settings.hpp"
#include "view/figure_text.hpp"
#include "view/overlay_text.hpp"
#include "view/stage_loop.hpp"

namespace pf {

// Share of the run. 0: it has no set end.
double Stage::share_done() const {
  const auto num = static_cast<double>(num_frames_ - first_frame_);
  if (replay_) return num / static_cast<double>(std::max<std::int64_t>(replay_->num_frames(), 1));
  if (options_.still_s) {
    const double start_s = options_.data.start ? options_.data.start->simulated_s : 0.0;
    return (simulation_.view().simulated_s - start_s) / std::max(*options_.still_s - start_s, 1e-300);
  }
  const auto num_frames_of = [](const Settings& s) { return s.seconds * s.frame_rate_hz; };
  double num_last = num_frames_of(simulation_.settings());
  if (options_.cues) {
    num_last = 0.0;
    for (const Cue& cue : options_.cues->cues) {
      if (cue.settings.seconds == 0.0) return 0.0;  // until its ball leaves
      num_last += num_frames_of(cue.settings);
    }
  }
  num_last -= static_cast<double>(first_frame_);
  return num_last > 0.0 ? num / num_last : 0.0;
}

void Stage::show_progress() {
  if (!progress_ || !progress_->is_due()) return;
  const double share = std::clamp(share_done(), 0.0, 1.0);
  const std::string done = share > 0.0 ? fmt::format(" ({:.0f} %)", 100.0 * share) : "";
  progress_->show(fmt::format("frame {}{}, t = {:.4g} s{}", grouped(static_cast<std::uint64_t>(num_frames_)),
                              done, simulation_.view().simulated_s,
                              time_left_text(share, progress_->spent_s())));
}

// Says once where run.max_substeps keeps the flight slower than run.time_scale asks.
void Stage::say_if_slowed() {
  const FrameView& view = simulation_.view();
  const Settings& settings = simulation_.settings();
  const bool may_be_limited = settings.substeps == 0 && view.dt_s > 0.0 &&
                              static_cast<std::int64_t>(view.steps_per_frame) >= settings.max_substeps;
  if (!progress_ || replay_ || is_slowness_told_ || !may_be_limited) return;
  if (view.slow_motion > 0.95 * settings.time_scale) return;
  is_slowness_told_ = true;
  const double num_needed = std::ceil(settings.time_scale / (settings.frame_rate_hz * view.dt_s));
  static const double num_allowed = find_field("run.max_substeps", "--set").max;
  const bool can_raise = !options_.data.start && num_needed <= num_allowed;
  hooks_.announce(fmt::format(
      "run.time_scale: {:g} needs {} a frame, but run.max_substeps is {}, so that it is {:.2g} here{}",
      settings.time_scale, counted(static_cast<std::uint64_t>(num_needed), "step"), settings.max_substeps,
      view.slow_motion,
      can_raise ? fmt::format("; to raise that, --set run.max_substeps={:.0f}", num_needed) : ""));
}

void Stage::say_what_flew() {
  if (!progress_) return;
  ProgressLine::clear();
  if (replay_) return;  // it has a summary of its own
  if (was_interrupted_) hooks_.announce("stopped by a signal before its end");
  const FrameView& view = simulation_.view();
  std::string line =
      fmt::format("{} to t = {:.4g} s in {:.1f} s: {}, {}{}",
                  counted(static_cast<std::uint64_t>(num_frames_ - first_frame_), "frame"), view.simulated_s,
                  progress_->spent_s(), counted(view.totals.num_steps, "step"),
                  counted(view.totals.num_collisions, "collision"),
                  first_frame_ > 0 ? " since the start of the run" : "");
  if (view.physics->ball.exists)
    line += fmt::format("; the ball has flown {:.2f} m, now at {:.2f} m/s and {:.1f} rad/s",
                        view.ball_distance_m, length(view.ball.velocity_mps), view.ball.spin_radps);
  hooks_.announce(line);
}

// Says how a second flight differs from the first, or why there is none any more. split:
// FlightPair::report().
void Stage::say_what_second_flew(const nlohmann::json& split) {
  if (!progress_ || replay_) return;
  if (split.is_null()) {
    const std::string why = pair_.view().message;
    if (pair_.num_begun() > 0 && !why.empty()) hooks_.announce(why);
    return;
  }
  const nlohmann::json& compared = split["compared"];
  const bool has_ball = simulation_.view().physics->ball.exists;
  std::string line = fmt::format("the second flight ({}) beside the first, {:.4g} s after the {}",
                                 split_names(simulation_.settings(), pair_.difference()).second,
                                 compared["until_s"].get<double>(), has_ball ? "launch" : "start");
  if (const nlohmann::json& distance = compared["distance_m"]; !distance.is_null())
    line += fmt::format("; balls {} apart, {} at most", length_text(distance["final"]),
                        length_text(distance["max"]));
  const nlohmann::json& drift = compared["energy_drift"];
  if (drift["first"].is_number() && drift["second"].is_number())
    line +=
        fmt::format("; energy {}, the first's {}", drift_text(drift["second"]), drift_text(drift["first"]));
  if (const nlohmann::json& ratio = compared["cost_ms_per_s"]["ratio"]; ratio.is_number())
    line += fmt::format("; {} times the computing time", digits(ratio));
  hooks_.announce(line);
}

}  // namespace pf
