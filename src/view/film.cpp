#include "view/film.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/frame_names.hpp"
#include "core/text.hpp"

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

Film::Film(const Options& options, SizePx size, const std::function<void(const std::string&)>& announce)
    : picture_file_(options.picture), size_(even(size)) {
  if (options.record.empty()) return;
  const bool frames_asked = is_frame_pattern(options.record);
  if (!frames_asked && ffmpeg_available()) {
    encoder_ =
        std::make_unique<Encoder>(options.record, size_.width, size_.height, options.settings.frame_rate_hz);
    reader_.emplace(size_, [this](std::span<const std::uint8_t> rgba) { encoder_->add_frame(rgba); });
    return;
  }
  const std::filesystem::path pattern = frames_asked ? options.record : frames_instead_of(options.record);
  frames_.emplace(pattern, size_);
  reader_.emplace(size_, [this](std::span<const std::uint8_t> rgba) { frames_->add_frame(rgba); });
  if (frames_asked || !announce) return;
  announce(fmt::format(
      "--record: no ffmpeg on the PATH to write {} with; its frames go to {} instead (a film of them: "
      "ffmpeg -framerate {} -i FRAMES FILM; to install it on Debian or Ubuntu: apt install ffmpeg)",
      in_quotes(options.record.string()), in_quotes(pattern.string()), options.settings.frame_rate_hz));
}

void Film::add_frame(GLuint framebuffer, SizePx size) {
  if (!reader_) return;
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
  if (!reader_) return;
  reader_->finish();
  if (encoder_) encoder_->finish();
  if (frames_) frames_->finish();
}

}  // namespace pf
