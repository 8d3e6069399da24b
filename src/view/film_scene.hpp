// The scene as the film shows it: at the film's size and without the panel, apart from the window's picture.
#pragma once

#include <memory>

#include "view/cue_title.hpp"
#include "view/gui.hpp"
#include "view/magnifier.hpp"
#include "view/overlay.hpp"
#include "view/renderer.hpp"
#include "view/scene_marks.hpp"
#include "view/split_picture.hpp"

namespace pf {

// Text has the share of the picture that it has in a window of 1280x720.
float film_scale(SizePx size);

// The window's view in another picture: all of the world if the window shows that, else the same middle and
// at least as much around it. seen, region: what is free for the scene, in the window and there.
Camera camera_like(const Camera& window, const ViewRegion& seen, const ViewRegion& region, const World& world,
                   float scale);

class FilmScene {
 public:
  explicit FilmScene(SizePx size);

  // The window's look; to be set before each frame.
  void set_look(const Look& look);
  // Sets the scene of two flights; null: there is one flight. Must stay valid until the frame is drawn.
  void set_split(const SplitScene* split) { split_ = split; }
  void set_magnifier(MagnifierMode mode) { magnifier_mode_ = mode; }
  // As Renderer::draw_air, in the window's view. seen: the part of the window that is free for the scene.
  void draw_air(const FrameView& frame, const ParcelBuffers& parcels, const Camera& window,
                const ViewRegion& seen, const Overlay* overlay);
  // Paths and ball, the overlay with the legend if overlay is not null, and the cue's title. window_gui is
  // current before and after.
  void draw_rest(const FrameView& frame, const Overlay* overlay, CueTitle& title, Gui& window_gui);

  GLuint framebuffer() const { return canvas_.framebuffer(); }
  SizePx size() const { return size_; }

 private:
  OverlayMode mode() const;

  SizePx size_;
  float scale_;
  ColorTarget canvas_;
  Renderer renderer_;  // of its own: it keeps a picture of the floor for one view
  Gui gui_;
  SceneMarks marks_;
  SplitPicture second_;
  const SplitScene* split_ = nullptr;
  Camera camera_;
  std::unique_ptr<Magnifier> magnifier_;
  MagnifierMode magnifier_mode_ = MagnifierMode::automatic;
  float magnifier_px_ = 0.0F;
  PxRect title_place_;  // in the last picture
  Look look_;
};

}  // namespace pf
