// The scene drawn for the film alone: at the film's size, without the panel, beside what the window shows.
#pragma once

#include "view/gui.hpp"
#include "view/overlay.hpp"
#include "view/renderer.hpp"

namespace pf {

class FilmScene {
 public:
  explicit FilmScene(SizePx size);

  // As Renderer::draw_air, in the window's view: all of the world if that is what it shows, else the same
  // middle and at least as much around it. seen: the part of the window that is free for the scene.
  void draw_air(const FrameView& frame, const ParcelBuffers& parcels, const Camera& window,
                const ViewRegion& seen, bool overlay);
  // Paths and ball, and the overlay if it is not null. window_gui is current before and after.
  void draw_rest(const FrameView& frame, bool show_path, const Overlay* overlay, Gui& window_gui);

  GLuint framebuffer() const { return canvas_.framebuffer(); }
  SizePx size() const { return size_; }

 private:
  SizePx size_;
  float scale_;
  ColorTarget canvas_;
  Renderer renderer_;  // of its own: it keeps a picture of the floor for one view
  Gui gui_;
  Camera camera_;
};

}  // namespace pf
