// Marks in the scene itself: notices, the legend of the flights, numbers at the ends of paths, and the arrow
// while a launch is aimed.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/simulation.hpp"
#include "view/camera.hpp"
#include "view/flight_legend.hpp"
#include "view/gui.hpp"
#include "view/inset_place.hpp"
#include "view/look.hpp"
#include "view/overlay.hpp"

namespace pf {

// Place and style of the drawn scene.
struct ScenePlace {
  const Camera& camera;
  OverlayPlace place;      // of the scene, above the overlay
  float height_px = 0.0F;  // of the window
  Look look;
  float magnifier_px = 0.0F;             // side of its square; 0: there is none
  double magnifier_metres_per_px = 0.0;  // in it
  PxRect title = {};  // of a cue, over the scene, or empty; the magnifier keeps clear of it
};

// Notices of the window alone, not of a film. Empty: none.
struct WindowNotices {
  std::string film;       // that runs, beside a red dot
  std::string news;       // of films and pictures
  std::string keys;       // what a key has just done, or asks
  float below_px = 0.0F;  // from the window's top: what covers the picture there
};

class SceneMarks {
 public:
  void show(const FrameView& frame, const ScenePlace& all, const WindowNotices& notices = {});
  // Rectangles of legend, notices, magnifier and numbers in the last frame.
  void note(ControlMap& controls) const;
  // The magnifier's square in the last frame; none: there was none, or no place for it.
  const std::optional<PxRect>& magnifier() const { return magnifier_; }
  // The part of the free region that a fitted world fills, so that the legend stands beside it.
  ViewRegion region_for_world(const FrameView& frame, const Look& look, const ViewRegion& free,
                              float scale) const;
  // The place where the ball starts, with some room around it. Empty without a ball.
  static PxRect start_rect(const FrameView& frame, const Camera& camera, float height_px, float scale);
  // Around a ball that can be pulled, with a hint beside it; empty: none.
  static void show_ring(Vec2d ball_m, double radius_px, const std::string& hint, const ScenePlace& scene);
  // Arrow and figures at the ball's start.
  static void show_aim(const BallLaunch& launch, Vec2d start_m, double ball_radius_m,
                       const ScenePlace& scene);

 private:
  ViewRegion show_legend(const FrameView& frame, const ScenePlace& scene);
  void fade_legend(bool covers_ball, int first_vertex);
  void show_magnifier(const FrameView& frame, const ScenePlace& scene);
  void show_numbers(const FrameView& frame, const ScenePlace& scene);
  std::vector<PxRect> rectangles() const;

  FlightLegend legend_;
  float legend_alpha_ = 1.0F;
  std::optional<PxRect> magnifier_;
  std::map<std::string, std::array<float, 4>> rectangles_;
};

}  // namespace pf
