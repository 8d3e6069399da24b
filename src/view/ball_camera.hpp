// A camera that keeps the ball in the middle of the picture.
#pragma once

#include <cstdint>

#include "app/simulation.hpp"
#include "view/camera.hpp"

namespace pf {

// Position of the ball in the picture of the frame whose steps have begun. Exact but for the velocity that
// parcels and the Magnus force add within the frame.
Vec2d ball_in_picture(const FrameView& frame);

// The rest of a distance after so many seconds of wall time. It does not depend on their division into
// frames.
double eased(double distance, double passed_s);

// The ball stands still in the picture, whatever its speed. At the start, and where the ball jumps to another
// place (a launch, a jump back), the camera glides there.
class BallCamera {
 public:
  bool is_on() const { return on_; }
  // Goes nearer until the ball is well visible in the region, never farther away.
  void start(const Camera& from, double ball_radius_m, const ViewRegion& region);
  // Leaves the picture where it is, or fits it if it was fitted at the start.
  void stop(Camera& camera, bool back_to_fit);
  // By the wheel: factor > 1 goes nearer.
  void zoom(double factor, double width_m);
  // ball_m: in the frame that is drawn. num_flights: FrameView's, for jumps. passed_s: wall time.
  struct Seen {
    Vec2d ball_m;
    std::int64_t num_flights = 0;
    double passed_s = 0.0;
  };
  void move(const Seen& seen, const World& world, const ViewRegion& region, Camera& camera);

 private:
  bool on_ = false;
  bool was_fitted_ = false;
  bool is_new_ = false;
  std::int64_t num_flights_ = 0;
  Vec2d offset_m_;  // from the ball to the middle of the picture
  double wanted_metres_per_px_ = 0.01;
};

}  // namespace pf
