// Aiming with the mouse: the ball is pulled back like a slingshot's; with Shift the pull turns into spin.
#pragma once

#include <algorithm>
#include <optional>

#include "app/simulation.hpp"

namespace pf {

// Radius of the ring that shows where the ball can be grabbed. scale: pixels per layout pixel.
inline double ring_radius_px(double ball_radius_px, double scale) {
  constexpr double kMinBall_px = 6.0;
  constexpr double kGap_px = 6.0;
  return std::max(ball_radius_px, kMinBall_px * scale) + kGap_px * scale;
}

class Aim {
 public:
  bool active() const { return active_; }
  // current: the launch without any pull. scale: pixels per layout pixel.
  void begin(const BallLaunch& current, double scale);
  // moved_px: the pointer's way since the last call, upwards positive. With spin, up is counter-clockwise.
  void drag(Vec2d moved_px, bool spin);
  void cancel() { active_ = false; }
  // Ends it. No launch if nothing was pulled, as after a click.
  std::optional<BallLaunch> release();

  const BallLaunch& launch() const { return launch_; }

 private:
  bool active_ = false;
  bool pulled_ = false;
  double mps_per_px_ = 0.25;
  double radps_per_px_ = 0.5;
  double min_px_ = 3.0;
  Vec2d pull_px_;
  double spin_px_ = 0.0;
  BallLaunch current_, launch_;
};

}  // namespace pf
