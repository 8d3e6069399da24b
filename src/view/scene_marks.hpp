// What is written into the scene itself: notices, the legend of the flights with their figures, numbers at
// the ends of paths, and the arrow while a launch is aimed.
#pragma once

#include <string>
#include <vector>

#include "app/simulation.hpp"
#include "view/camera.hpp"
#include "view/look.hpp"
#include "view/overlay.hpp"

namespace pf {

// One flight as the legend shows it.
struct FlightRow {
  std::string number, method, speed, spin, apart, energy, cost;
};

// The flights of a frame, the present one first. Columns apart, energy and cost are filled for flights of the
// present launch if there are several: apart from the first of them, at the end and at most.
std::vector<FlightRow> flight_rows(const FrameView& frame);

class SceneMarks {
 public:
  // place: of the scene, as for the overlay. height_px: of the window.
  void show(const FrameView& frame, const Camera& camera, const OverlayPlace& place, float height_px,
            const Look& look);
  // Kept free for the legend at the top when the world is fitted: that of three flights. Longer ones, and
  // very large text, let the scene shine through.
  static float reserved_px(const FrameView& frame, const Look& look, float scale, float height_px);
  // Arrow and figures at the ball's start.
  static void show_aim(const BallLaunch& launch, Vec2d start_m, double ball_radius_m, const Camera& camera,
                       const OverlayPlace& place, float height_px, const Look& look);

 private:
  void write_rows(const FrameView& frame);
  ImVec2 show_flights(const FrameView& frame, const OverlayPlace& place, const Look& look);
  static void show_numbers(const FrameView& frame, const Camera& camera, const OverlayPlace& place,
                           float height_px, const Look& look);

  std::vector<FlightRow> rows_;
  std::int64_t written_flight_ = -1;
  int frames_since_ = 0;
};

}  // namespace pf
