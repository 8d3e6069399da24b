#include "view/capture.hpp"

#include <fmt/format.h>
#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/error.hpp"

namespace pf {
namespace {

std::size_t bytes_of(SizePx size) {
  return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height) * 4;
}

}  // namespace

void write_png(const std::filesystem::path& file, std::span<const std::uint8_t> rgba, int width_px,
               int height_px) {
  const auto width = static_cast<std::size_t>(width_px);
  std::vector<std::uint8_t> rgb(width * static_cast<std::size_t>(height_px) * 3);
  for (std::size_t pixel = 0; pixel < rgb.size() / 3; ++pixel)
    std::memcpy(&rgb[3 * pixel], &rgba[4 * pixel], 3);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_px);
  image.height = static_cast<png_uint_32>(height_px);
  image.format = PNG_FORMAT_RGB;
  const auto stride = -static_cast<png_int_32>(3 * width);  // negative: the bottom row comes first
  if (png_image_write_to_file(&image, file.c_str(), 0, rgb.data(), stride, nullptr) == 0) {
    throw UserError(fmt::format("{}: the picture cannot be written ({}); choose another file", file.string(),
                                image.message));
  }
}

std::vector<std::uint8_t> read_pixels(GLuint framebuffer, SizePx size) {
  std::vector<std::uint8_t> rgba(bytes_of(size));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadnPixels(0, 0, size.width, size.height, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(rgba.size()),
                rgba.data());
  return rgba;
}

FrameReader::FrameReader(SizePx size, Receiver receiver) : size_(size), receiver_(std::move(receiver)) {
  const auto bytes = static_cast<GLsizeiptr>(bytes_of(size));
  const GLbitfield access = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  for (Slot& slot : slots_) {
    slot.buffer = make_buffer();
    glNamedBufferStorage(slot.buffer.get(), bytes, nullptr, access | GL_CLIENT_STORAGE_BIT);
    slot.memory =
        static_cast<const std::uint8_t*>(glMapNamedBufferRange(slot.buffer.get(), 0, bytes, access));
    if (slot.memory == nullptr) throw DeviceError("glMapNamedBufferRange: no memory to read frames back");
  }
}

void FrameReader::read(GLuint framebuffer) {
  Slot& slot = slots_[next_];
  hand_on(slot);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, slot.buffer.get());
  glReadPixels(0, 0, size_.width, size_.height, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  slot.fence.place();
  next_ = (next_ + 1) % slots_.size();
}

void FrameReader::finish() {
  for (std::size_t i = 0; i < slots_.size(); ++i) hand_on(slots_[(next_ + i) % slots_.size()]);
}

void FrameReader::hand_on(Slot& slot) {
  if (!slot.fence.placed()) return;
  slot.fence.wait();
  receiver_({slot.memory, bytes_of(size_)});
}

}  // namespace pf
