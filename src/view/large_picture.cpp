#include "view/large_picture.hpp"

#include <imgui.h>

#include <algorithm>
#include <cstring>

#include "view/ball_camera.hpp"
#include "view/gui_tiles.hpp"
#include "view/profile_strip.hpp"

namespace pf {
namespace {

constexpr int kUsualTile_px = 4096;

int tile_limit(int wanted_px) {
  GLint texture_px = 0;
  GLint viewport_px[2] = {0, 0};
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &texture_px);
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport_px);
  const int allowed = std::min({texture_px, viewport_px[0], viewport_px[1]});
  return std::min(allowed, wanted_px > 0 ? wanted_px : kUsualTile_px);
}

// Draws the tiles of one picture.
class Painter {
 public:
  Painter(const LargePictureRequest& request, const PictureScene& scene)
      : request_(request), scene_(scene), scale_(scale_of(request.size, scene)), gui_(scale_) {
    renderer_.set_look(scene.look);
    renderer_.set_parcel_size({.as_squares = true});
    lay_out();  // the legend is measured
    lay_out();
    if (magnifier_) magnifier_->draw_flight(*scene.frame);
  }

  Pixels paint() {
    const SizePx size = request_.size;
    Pixels picture = {{}, size, request_.transparent ? PngAlpha::kept : PngAlpha::left_out};
    picture.rgba.resize(std::size_t{4} * static_cast<std::size_t>(size.width) *
                        static_cast<std::size_t>(size.height));
    for (const Tile& tile : tiles_of(size, tile_limit(request_.max_tile_px)))
      copy(paint(tile), tile, picture);
    return picture;
  }

 private:
  static float scale_of(SizePx size, const PictureScene& scene) {
    return scene.scale *
           std::min(static_cast<float>(size.width) / static_cast<float>(scene.window_size.width),
                    static_cast<float>(size.height) / static_cast<float>(scene.window_size.height));
  }
  bool has_marks() const { return scene_.overlay != nullptr && !request_.transparent; }

  void lay_out() {
    const FrameView& frame = *scene_.frame;
    const auto width = static_cast<float>(request_.size.width);
    const auto height = static_cast<float>(request_.size.height);
    const OverlayMode mode = Overlay::fitting_mode(scene_.mode, {0.0F, width, height, scale_});
    const float bottom = has_marks() ? scene_.overlay->used_height_px(mode, scale_) : 0.0F;
    Look look = scene_.look;
    look.paths = look.paths && has_marks() && mode != OverlayMode::off;
    const ViewRegion free = {0.0, bottom, width, std::max(height - bottom, 1.0F)};
    const ViewRegion region = has_marks() ? marks_.region_for_world(frame, look, free, scale_) : free;
    camera_ = camera_like(*scene_.window, scene_.seen, region, frame.physics->world, scale_);
    const bool is_wanted = has_marks() && mode != OverlayMode::off &&
                           Magnifier::is_wanted(scene_.magnifier, frame, camera_, scale_, true);
    const float side_px = is_wanted ? Magnifier::side_px(static_cast<float>(region.width_px),
                                                         static_cast<float>(region.height_px), scale_)
                                    : 0.0F;
    if (side_px > 0.0F) draw_magnified(side_px);
    if (!has_marks()) return;
    gui_.make_current();
    gui_.set_look(look.theme, scale_);
    gui_.begin_frame(request_.size, 1.0 / 60.0);
    Overlay overlay = scene_.overlay->for_picture();
    overlay.show(frame, mode, {0.0F, width, height, scale_}, look);
    const double magnified = magnifier_ ? magnifier_->camera().metres_per_px : 0.0;
    const OverlayPlace place = {0.0F, width, height - bottom, scale_};
    marks_.show(frame, {camera_, place, height, look, side_px, magnified, title_place_});
    if (scene_.title != nullptr)
      title_place_ = scene_.title->show(above_profile_strip(place, frame), look.theme,
                                        SceneMarks::start_rect(frame, camera_, height, scale_));
    gui_.end_frame();
    scene_.window_gui->make_current();
  }

  void draw_magnified(float side_px) {
    if (!magnifier_) magnifier_ = std::make_unique<Magnifier>();
    magnifier_->set_look(scene_.look);
    magnifier_->draw_air(*scene_.frame, *scene_.parcels, scene_.frame->ball.position_m, camera_, side_px,
                         scale_);
  }

  std::vector<std::uint8_t> paint(const Tile& tile) {
    canvas_.resize(tile.size.width, tile.size.height);
    const Viewport viewport = {canvas_.framebuffer(), canvas_.texture(),    tile.size,           scale_,
                               tile.origin_px,        request_.size.height, request_.transparent};
    renderer_.draw_air(*scene_.frame, scene_.parcels, camera_, viewport);
    renderer_.draw_flight(*scene_.frame, camera_, viewport);
    if (has_marks()) {
      if (magnifier_ && marks_.magnifier()) magnifier_->copy(*marks_.magnifier(), viewport);
      gui_.make_current();
      gui_tiles_.draw(*ImGui::GetDrawData(), viewport);
      scene_.window_gui->make_current();
    }
    return read_pixels(viewport.framebuffer, tile.size);
  }

  static void copy(const std::vector<std::uint8_t>& from, const Tile& tile, Pixels& to) {
    const std::size_t row_bytes = std::size_t{4} * static_cast<std::size_t>(tile.size.width);
    for (int y = 0; y < tile.size.height; ++y) {
      const auto row = static_cast<std::size_t>(tile.origin_px.y) + static_cast<std::size_t>(y);
      const std::size_t at =
          4 * (row * static_cast<std::size_t>(to.size.width) + static_cast<std::size_t>(tile.origin_px.x));
      std::memcpy(&to.rgba[at], &from[static_cast<std::size_t>(y) * row_bytes], row_bytes);
    }
  }

  const LargePictureRequest& request_;
  const PictureScene& scene_;
  float scale_;
  Gui gui_;
  GuiTiles gui_tiles_;
  Renderer renderer_;
  SceneMarks marks_;
  Camera camera_;
  std::unique_ptr<Magnifier> magnifier_;
  PxRect title_place_;
  ColorTarget canvas_;
};

}  // namespace

std::vector<Tile> tiles_of(SizePx picture, int max_tile_px) {
  std::vector<Tile> tiles;
  for (int y = 0; y < picture.height; y += max_tile_px) {
    for (int x = 0; x < picture.width; x += max_tile_px) {
      tiles.push_back(
          {{x, y}, {std::min(max_tile_px, picture.width - x), std::min(max_tile_px, picture.height - y)}});
    }
  }
  return tiles;
}

Pixels draw_large_picture(const LargePictureRequest& request, const PictureScene& scene) {
  return Painter(request, scene).paint();
}

}  // namespace pf
