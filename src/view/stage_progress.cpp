// What a run without a window says of itself.
#include <fmt/format.h>

#include <algorithm>

#include "view/overlay_text.hpp"
#include "view/stage_loop.hpp"

namespace pf {

// Share of the run. 0: it has no set end.
double Stage::share_done() const {
  const auto num = static_cast<double>(num_frames_ - first_frame_);
  if (replay_) return num / static_cast<double>(std::max<std::int64_t>(replay_->num_frames(), 1));
  if (options_.still_s) return simulation_.view().simulated_s / std::max(*options_.still_s, 1e-300);
  const Settings& settings = simulation_.settings();
  const double num_last = settings.seconds * settings.frame_rate_hz - static_cast<double>(first_frame_);
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

void Stage::say_what_flew() {
  if (!progress_) return;
  ProgressLine::clear();
  if (replay_) return;  // it has a summary of its own
  const FrameView& view = simulation_.view();
  std::string line =
      fmt::format("{} to t = {:.4g} s in {:.1f} s: {}, {}",
                  counted(static_cast<std::uint64_t>(num_frames_ - first_frame_), "frame"), view.simulated_s,
                  progress_->spent_s(), counted(view.totals.num_steps, "step"),
                  counted(view.totals.num_collisions, "collision"));
  if (view.physics->ball.exists)
    line += fmt::format("; the ball has flown {:.2f} m, now at {:.2f} m/s and {:.1f} rad/s",
                        view.ball_distance_m, length(view.ball.velocity_mps), view.ball.spin_radps);
  hooks_.announce(line);
}

}  // namespace pf
