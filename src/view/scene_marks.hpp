// Marks in the scene itself: notices, the legend of the flights, numbers at the ends of paths, and the arrow
// while a launch is aimed.
#pragma once

#include <string>
#include <utility>

#include "app/simulation.hpp"
#include "view/camera.hpp"
#include "view/flight_legend.hpp"
#include "view/look.hpp"
#include "view/overlay.hpp"

namespace pf {

// Where the scene is drawn, and how.
struct ScenePlace {
  const Camera& camera;
  OverlayPlace place;      // of the scene, above the overlay
  float height_px = 0.0F;  // of the window
  Look look;
};

class SceneMarks {
 public:
  // A line below the notices of the frame; empty: none.
  void say(std::string line) { said_ = std::move(line); }
  void show(const FrameView& frame, const ScenePlace& scene);
  // The part of the free region that a fitted world fills, so that the legend stands beside it.
  ViewRegion region_for_world(const FrameView& frame, const Look& look, const ViewRegion& free,
                              float scale) const;
  // Around a ball that can be pulled, with a hint beside it; empty: none.
  static void show_ring(Vec2d ball_m, double radius_px, const std::string& hint, const ScenePlace& scene);
  // Arrow and figures at the ball's start.
  static void show_aim(const BallLaunch& launch, Vec2d start_m, double ball_radius_m,
                       const ScenePlace& scene);

 private:
  ViewRegion show_legend(const FrameView& frame, const ScenePlace& scene);
  static void show_numbers(const FrameView& frame, const ScenePlace& scene);

  FlightLegend legend_;
  std::string said_;
};

}  // namespace pf
