// A still: the run goes on to its moment and ends there.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "scene/derive.hpp"
#include "scene/settings.hpp"
#include "view/stage_loop.hpp"

namespace pf {

// The last frame is as long as the way that is left, or has as many steps as reach its end.
void Stage::steer_to_still() {
  const Settings& settings = simulation_.settings();
  const double left_s = left_to_still_s();
  if (left_s <= 0.0) {
    commands_.toggle_pause = !simulation_.view().paused;  // T = 0: the start is drawn, without a step
  } else if (paces_by_substeps(settings)) {
    const auto num_left = static_cast<std::int64_t>(
        std::min(std::ceil(left_s / settings.dt_s - 1e-9), static_cast<double>(settings.substeps)));
    if (num_left == settings.substeps) return;
    commands_.settings = settings;
    commands_.settings->substeps = std::max<std::int64_t>(num_left, 1);
  } else if (left_s < settings.time_scale / settings.frame_rate_hz) {
    commands_.settings = settings;
    commands_.settings->time_scale = left_s * settings.frame_rate_hz;
  }
}

// Simulated time until the still. 0 when no frame can be as short.
double Stage::left_to_still_s() const {
  const double left_s = *options_.still_s - simulation_.view().simulated_s;
  static const double min_scale = find_field("run.time_scale", "--still").min;
  return left_s * simulation_.settings().frame_rate_hz < min_scale ? 0.0 : left_s;
}

void Stage::refuse_still_before_its_time() const {
  if (left_to_still_s() > 0.0)
    throw UserError(
        fmt::format("--still: stopped at {:.9g} s of simulated time, before {} s; there is no picture",
                    simulation_.view().simulated_s, *options_.still_s));
}

bool Stage::still_ended() const {
  const FrameView& view = simulation_.view();
  const bool is_there = num_frames_ > first_frame_ && left_to_still_s() <= 0.0;
  // Steps of a set length end where they do.
  if (const double late_s = view.simulated_s - *options_.still_s;
      is_there && hooks_.announce && late_s > 1e-3 * view.dt_s)
    hooks_.announce(fmt::format("--still: no step of {:g} s ends at {} s; the picture is of {:.9g} s",
                                view.dt_s, *options_.still_s, view.simulated_s));
  if (is_there) return true;
  const bool stands = view.paused || (view.flight == Flight::landed && !simulation_.settings().relaunch);
  if (!stands) return false;
  throw UserError(fmt::format("--still: the flight ends at {} s of simulated time{}{}; give an earlier time",
                              view.simulated_s, view.message.empty() ? "" : ": ", view.message));
}

}  // namespace pf
