// A second picture of the ball and the parcels around it, much nearer than the first, in a square of its own.
#pragma once

#include <string>

#include "view/px_rect.hpp"
#include "view/renderer.hpp"

namespace pf {

// The magnification: the ball fills a fixed part of the square, times the factor of the wheel.
class MagnifierZoom {
 public:
  // factor > 1 goes nearer.
  void change(double factor);
  // In its square; at most that of the picture around it, which it never shows smaller.
  double metres_per_px(double ball_radius_m, double side_px, double around_metres_per_px);

 private:
  double nearer_ = 1.0;      // than usual
  double min_nearer_ = 0.0;  // as near as the picture around it
};

class Magnifier {
 public:
  // Returns whether it is shown over the picture of that camera. with_marks: legend and overlay are shown.
  static bool is_wanted(MagnifierMode mode, const FrameView& frame, const Camera& camera, float scale,
                        bool with_marks);
  // Side of its square in the free part of a picture.
  static float side_px(float free_width_px, float free_height_px, float scale);

  void set_look(const Look& look);
  void zoom(double factor) { zoom_.change(factor); }  // by the wheel
  // Draws floor and parcels around the ball, which will be there. Before the buffers are written anew.
  // around: the camera of the picture around it.
  void draw_air(const FrameView& frame, const ParcelBuffers& parcels, Vec2d ball_m, const Camera& around,
                float side_px, float scale);
  // Adds paths and ball.
  void draw_flight(const FrameView& frame);
  // Copies it to its place in a picture.
  void copy(const PxRect& place, const Viewport& to) const;

  const Camera& camera() const { return camera_; }

 private:
  Viewport viewport() const;

  Renderer renderer_;  // of its own: it keeps a picture of the floor for one view
  ColorTarget canvas_;
  Camera camera_;
  MagnifierZoom zoom_;
  int side_px_ = 0;
  float scale_ = 1.0F;
};

// Frame and scale of the magnifier, described to ImGui. magnification: relative to the picture around it.
struct MagnifierScale {
  double magnification = 1.0;
  double metres_per_px = 1.0;  // in it
};
void paint_magnifier_frame(const PxRect& place, const MagnifierScale& scale, Theme theme, float ui_scale);

// The longest of 1, 2 or 5 times a power of ten that is at most so long, with its text: "2 cm".
struct ScaleBar {
  double length_m = 0.0;
  std::string text;
};
ScaleBar scale_bar(double max_length_m);

}  // namespace pf
