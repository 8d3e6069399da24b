#include "view/film.hpp"

#include <algorithm>

namespace pf {
namespace {

// yuv420p halves both sides of the picture.
SizePx even(SizePx size) { return {size.width & ~1, size.height & ~1}; }

// Copies into `to` with the aspect kept and black beside it.
void blit_fitting(GLuint from, SizePx from_size, const ColorTarget& to) {
  const double scale = std::min(static_cast<double>(to.width_px()) / from_size.width,
                                static_cast<double>(to.height_px()) / from_size.height);
  const int width = static_cast<int>(from_size.width * scale);
  const int height = static_cast<int>(from_size.height * scale);
  const int left = (to.width_px() - width) / 2;
  const int bottom = (to.height_px() - height) / 2;
  const GLfloat black[4] = {0.0F, 0.0F, 0.0F, 1.0F};
  glClearNamedFramebufferfv(to.framebuffer(), GL_COLOR, 0, black);
  glBlitNamedFramebuffer(from, to.framebuffer(), 0, 0, from_size.width, from_size.height, left, bottom,
                         left + width, bottom + height, GL_COLOR_BUFFER_BIT, GL_LINEAR);
}

}  // namespace

Film::Film(const Options& options, SizePx size) : picture_file_(options.picture), size_(even(size)) {
  if (options.record.empty()) return;
  encoder_ =
      std::make_unique<Encoder>(options.record, size_.width, size_.height, options.settings.frame_rate_hz);
  reader_.emplace(size_, [this](std::span<const std::uint8_t> rgba) { encoder_->add_frame(rgba); });
}

void Film::add_frame(GLuint framebuffer, SizePx size) {
  if (!encoder_) return;
  if (even(size) == size_) {
    reader_->read(framebuffer);
    return;
  }
  scaled_.resize(size_.width, size_.height);
  blit_fitting(framebuffer, size, scaled_);
  reader_->read(scaled_.framebuffer());
}

void Film::keep_for_picture(GLuint framebuffer, SizePx size) {
  if (picture_file_.empty()) return;
  kept_.resize(size.width, size.height);
  glBlitNamedFramebuffer(framebuffer, kept_.framebuffer(), 0, 0, size.width, size.height, 0, 0, size.width,
                         size.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void Film::finish() {
  if (!picture_file_.empty() && has_picture()) {
    const SizePx size = {kept_.width_px(), kept_.height_px()};
    write_png(picture_file_, read_pixels(kept_.framebuffer(), size), size.width, size.height);
  }
  if (!encoder_) return;
  reader_->finish();
  encoder_->finish();
}

}  // namespace pf
