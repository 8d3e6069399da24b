// Aiming with the mouse: the ball is pulled back like a slingshot's; with Shift the pull turns into spin.
#pragma once

#include <optional>

#include "app/simulation.hpp"

namespace pf {

class Aim {
 public:
  bool active() const { return active_; }
  // present: what the ball would be launched with if nothing were pulled. scale: pixels per layout pixel.
  void begin(const BallLaunch& present, double scale);
  // moved_px: of the pointer since the last call, upwards positive. Across with spin up: counter-clockwise.
  void drag(Vec2d moved_px, bool spin);
  void cancel() { active_ = false; }
  // Ends it; none if nothing was pulled, as after a mere click.
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
  BallLaunch present_, launch_;
};

}  // namespace pf
