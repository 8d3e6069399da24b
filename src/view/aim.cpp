#include "view/aim.hpp"

#include <algorithm>
#include <cmath>

namespace pf {
namespace {

// A pull of 60 layout pixels is 15 m/s: the court's ball starts 70 pixels from the window's edge.
constexpr double kMpsPerPx = 0.25;
constexpr double kFastest_mps = 60.0;  // with that sling; faster scenes have a stronger one
constexpr double kRadpsPerPx = 0.5;
constexpr double kMin_px = 3.0;  // of a pull; a shorter one is a click

}  // namespace

void Aim::begin(const BallLaunch& current, double scale) {
  const double speed_mps = length(current.velocity_mps);
  active_ = true;
  pulled_ = false;
  mps_per_px_ = kMpsPerPx * std::max(1.0, speed_mps / kFastest_mps) / scale;
  radps_per_px_ = kRadpsPerPx / scale;
  min_px_ = kMin_px * scale;
  pull_px_ = {};
  spin_px_ = 0.0;
  current_ = launch_ = current;
}

void Aim::drag(Vec2d moved_px, bool spin) {
  if (!active_) return;
  if (spin) {
    spin_px_ += moved_px.y;
  } else {
    pull_px_ += moved_px;
  }
  const bool is_pulled = length(pull_px_) >= min_px_;
  launch_.velocity_mps = is_pulled ? pull_px_ * -mps_per_px_ : current_.velocity_mps;
  launch_.spin_radps =
      std::fabs(spin_px_) >= min_px_ ? current_.spin_radps + radps_per_px_ * spin_px_ : current_.spin_radps;
  pulled_ = is_pulled || launch_.spin_radps != current_.spin_radps;
}

std::optional<BallLaunch> Aim::release() {
  const bool launches = active_ && pulled_;
  active_ = false;
  return launches ? std::optional(launch_) : std::nullopt;
}

}  // namespace pf
