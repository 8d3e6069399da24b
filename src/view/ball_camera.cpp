#include "view/ball_camera.hpp"

#include <algorithm>
#include <cmath>

namespace pf {
namespace {

constexpr double kTime_s = 0.18;     // of easing
constexpr double kBallShare = 0.12;  // of the region's smaller side, at the start

}  // namespace

Vec2d ball_in_picture(const FrameView& frame) {
  const bool moves = frame.unfinished && frame.num_pictures <= 1 && !frame.physics->ball.held;
  if (!moves) return frame.ball.position_m;
  return frame.ball.position_m + frame.ball.velocity_mps * (frame.steps_per_frame * frame.dt_s);
}

double eased(double distance, double passed_s) { return distance * std::exp(-passed_s / kTime_s); }

void BallCamera::start(const Camera& from, double ball_radius_m, const ViewRegion& region) {
  on_ = is_new_ = true;
  was_fitted_ = from.fitted;
  const double ball_px = kBallShare * std::min(region.width_px, region.height_px);
  wanted_metres_per_px_ = std::min(from.metres_per_px, 2.0 * ball_radius_m / ball_px);
}

void BallCamera::stop(Camera& camera, bool back_to_fit) {
  if (on_ && back_to_fit && was_fitted_) camera.fitted = true;
  on_ = false;
}

void BallCamera::zoom(double factor, double width_m) {
  wanted_metres_per_px_ = within_zoom(wanted_metres_per_px_ / factor, width_m);
}

void BallCamera::move(const Seen& seen, const World& world, const ViewRegion& region, Camera& camera) {
  const bool jumps = is_new_ || seen.num_flights != num_flights_;
  if (jumps) offset_m_ = nearest_way(world, seen.ball_m, camera.to_world(region.center_px()));
  is_new_ = false;
  num_flights_ = seen.num_flights;
  offset_m_ = {eased(offset_m_.x, seen.passed_s), eased(offset_m_.y, seen.passed_s)};
  const double ratio = std::log(camera.metres_per_px / wanted_metres_per_px_);
  camera.metres_per_px = wanted_metres_per_px_ * std::exp(eased(ratio, seen.passed_s));
  camera.anchor_px = region.center_px();
  camera.center_m = seen.ball_m + offset_m_;
  camera.shows_images = world.boundary == Boundary::periodic;
  camera.fitted = false;
}

}  // namespace pf
