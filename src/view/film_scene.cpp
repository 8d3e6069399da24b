#include "view/film_scene.hpp"

#include <algorithm>

#include "view/ball_camera.hpp"
#include "view/profile_strip.hpp"

namespace pf {

float film_scale(SizePx size) {
  const float usual = std::min(static_cast<float>(size.height) / 720.0F, static_cast<float>(size.width) / 1280.0F);
  return std::clamp(usual, 0.5F, 4.0F);
}

Camera camera_like(const Camera& window, const ViewRegion& seen, const ViewRegion& region, const World& world,
                   float scale) {
  Camera camera;
  if (window.fitted) {
    fit_world(camera, world, region, scale);
    return camera;
  }
  camera.center_m = window.to_world(seen.center_px());
  camera.anchor_px = region.center_px();
  camera.metres_per_px =
      window.metres_per_px * std::max(seen.width_px / region.width_px, seen.height_px / region.height_px);
  camera.fitted = false;
  camera.shows_images = window.shows_images;
  return camera;
}

FilmScene::FilmScene(SizePx size) : size_(size), scale_(film_scale(size)), gui_(scale_) {
  canvas_.resize(size.width, size.height);
}

void FilmScene::set_look(const Look& look) {
  look_ = look;
  renderer_.set_look(look);
}

OverlayMode FilmScene::mode() const {
  return Overlay::fitting_mode(
      OverlayMode::full, {0.0F, static_cast<float>(size_.width), static_cast<float>(size_.height), scale_});
}

void FilmScene::draw_air(const FrameView& frame, const ParcelBuffers& parcels, const Camera& window,
                         const ViewRegion& seen, const Overlay* overlay) {
  const double bottom = overlay == nullptr ? 0.0 : overlay->used_height_px(mode(), scale_);
  const ViewRegion free = {0.0, bottom, static_cast<double>(size_.width),
                           std::max(size_.height - bottom, 1.0)};
  ViewRegion region = overlay == nullptr ? free : marks_.region_for_world(frame, look_, free, scale_);
  if (split_ != nullptr) {
    const bool has_strip = overlay != nullptr;
    region = second_.lay_out(*split_, has_strip ? above_profile_strip(free, frame, scale_) : free, scale_);
  }
  camera_ = camera_like(window, seen, region, frame.physics->world, scale_);
  const Viewport viewport = {canvas_.framebuffer(), canvas_.texture(), size_, scale_};
  renderer_.draw_air(frame, &parcels, camera_, viewport);
  magnifier_px_ = 0.0F;
  if (split_ != nullptr) return second_.draw_air(*split_, camera_, viewport);
  const bool is_wanted =
      overlay != nullptr && Magnifier::is_wanted(magnifier_mode_, frame, camera_, scale_, true);
  if (is_wanted)
    magnifier_px_ =
        Magnifier::side_px(static_cast<float>(region.width_px), static_cast<float>(region.height_px), scale_);
  if (magnifier_px_ <= 0.0F) return;
  if (!magnifier_) magnifier_ = std::make_unique<Magnifier>();
  magnifier_->set_look(look_);
  magnifier_->draw_air(frame, parcels, ball_in_picture(frame), camera_, magnifier_px_, scale_);
}

void FilmScene::draw_rest(const FrameView& frame, const Overlay* overlay, CueTitle& title, Gui& window_gui) {
  const Viewport viewport = {canvas_.framebuffer(), canvas_.texture(), size_, scale_};
  renderer_.draw_flight(frame, camera_, viewport);
  if (split_ != nullptr) second_.draw_flight(*split_, camera_, viewport);
  if (overlay == nullptr && title.opacity() == 0.0F && split_ == nullptr) return;
  const auto height_px = static_cast<float>(size_.height);
  OverlayPlace place = {0.0F, static_cast<float>(size_.width), height_px, scale_};
  gui_.make_current();
  gui_.set_look(look_.theme, scale_);
  gui_.begin_frame(size_, 1.0 / 60.0);
  if (split_ != nullptr) second_.describe(*split_, camera_, height_px, scale_);
  if (overlay != nullptr) {
    Overlay shown = overlay->for_picture();  // the window's own keeps its texts and their places
    shown.show(frame, mode(), place, look_);
    place.bottom_px -= shown.used_height_px(mode(), scale_);
    Look look = look_;
    look.paths = look.paths && split_ == nullptr;  // the legend's flights
    const double magnifier_scale = magnifier_ ? magnifier_->camera().metres_per_px : 0.0;
    WindowNotices notices;
    if (split_ != nullptr) notices.below_px = second_.covered_at_top_px(*split_, place, height_px);
    marks_.show(frame, {camera_, place, height_px, look, magnifier_px_, magnifier_scale, title_place_}, notices);
    place = above_profile_strip(place, frame);
  }
  title_place_ = title.show(place, look_.theme, SceneMarks::start_rect(frame, camera_, height_px, scale_));
  gui_.end_frame();
  if (marks_.magnifier()) {
    magnifier_->draw_flight(frame);
    magnifier_->copy(*marks_.magnifier(), viewport);
  }
  gui_.draw(canvas_.framebuffer(), size_);
  window_gui.make_current();
}

}  // namespace pf
