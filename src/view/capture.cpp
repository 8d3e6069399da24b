#include "view/capture.hpp"

#include <fmt/format.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.hpp"
#include "core/replace_file.hpp"

namespace pf {
namespace {

std::size_t bytes_of(SizePx size) {
  return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height) * 4;
}

void append_number(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xFFU);
}

// A chunk of a PNG (second edition, 5.3): length, name, data, checksum of name and data.
std::string png_chunk(const std::string& name_and_data) {
  std::string chunk;
  append_number(chunk, static_cast<std::uint32_t>(name_and_data.size() - 4));
  chunk += name_and_data;
  const auto* bytes = reinterpret_cast<const Bytef*>(name_and_data.data());
  append_number(chunk, static_cast<std::uint32_t>(crc32(0, bytes, static_cast<uInt>(name_and_data.size()))));
  return chunk;
}

// tEXt is for Latin letters, iTXt (not compressed, no language) for the rest.
std::string text_chunk(const std::string& keyword, const std::string& text) {
  const bool is_ascii = std::all_of(text.begin(), text.end(), [](char c) { return (c & 0x80) == 0; });
  const std::string nul(1, '\0');
  return png_chunk(is_ascii ? "tEXt" + keyword + nul + text : "iTXt" + keyword + std::string(5, '\0') + text);
}

std::vector<std::uint8_t> without_alpha(std::span<const std::uint8_t> rgba) {
  std::vector<std::uint8_t> rgb(rgba.size() / 4 * 3);
  for (std::size_t pixel = 0; pixel < rgb.size() / 3; ++pixel)
    std::memcpy(&rgb[3 * pixel], &rgba[4 * pixel], 3);
  return rgb;
}

// Divides the colours by alpha.
std::vector<std::uint8_t> straight_alpha(std::span<const std::uint8_t> rgba) {
  std::vector<std::uint8_t> straight(rgba.begin(), rgba.end());
  for (std::size_t at = 0; at < straight.size(); at += 4) {
    const unsigned alpha = straight[at + 3];
    for (std::size_t part = at; part < at + 3 && alpha > 0; ++part)
      straight[part] = static_cast<std::uint8_t>(std::min((straight[part] * 255U + alpha / 2) / alpha, 255U));
  }
  return straight;
}

std::string png_of(std::span<const std::uint8_t> rgba, SizePx size, PngAlpha alpha, std::string* problem) {
  const bool is_kept = alpha == PngAlpha::kept;
  const std::vector<std::uint8_t> pixels = is_kept ? straight_alpha(rgba) : without_alpha(rgba);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(size.width);
  image.height = static_cast<png_uint_32>(size.height);
  image.format = is_kept ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  const auto stride = -size.width * (is_kept ? 4 : 3);  // negative: the bottom row comes first
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string png(bytes, '\0');
  if (png_image_write_to_memory(&image, png.data(), &bytes, 0, pixels.data(), stride, nullptr) == 0)
    *problem = image.message;
  png.resize(bytes);
  return png;
}

}  // namespace

std::pair<std::string, std::string> software_text() {
  return {"Software", fmt::format("pickleflight {}", PF_VERSION)};
}

void write_png(const std::filesystem::path& file, std::span<const std::uint8_t> rgba, SizePx size,
               const PngTexts& texts, PngAlpha alpha) {
  std::string problem;
  std::string png = png_of(rgba, size, alpha, &problem);
  if (problem.empty()) {
    constexpr std::size_t kAfterHeader = 8 + 25;  // signature, IHDR
    std::string chunks;
    for (const auto& [keyword, text] : texts) chunks += text_chunk(keyword, text);
    png.insert(kAfterHeader, chunks);
    problem = replace_file(file, png);
    if (problem.empty()) return;
  }
  throw UserError(
      fmt::format("{}: the picture cannot be written ({}); choose another file", file.string(), problem));
}

void blit_fitting(GLuint from, const ViewRegion& source, const ColorTarget& to) {
  const double scale = std::min(to.width_px() / source.width_px, to.height_px() / source.height_px);
  const int width = static_cast<int>(std::lround(source.width_px * scale));
  const int height = static_cast<int>(std::lround(source.height_px * scale));
  const int left = (to.width_px() - width) / 2;
  const int bottom = (to.height_px() - height) / 2;
  const auto x = static_cast<int>(source.left_px);
  const auto y = static_cast<int>(source.bottom_px);
  const GLfloat black[4] = {0.0F, 0.0F, 0.0F, 1.0F};
  glClearNamedFramebufferfv(to.framebuffer(), GL_COLOR, 0, black);
  glBlitNamedFramebuffer(from, to.framebuffer(), x, y, x + static_cast<int>(source.width_px),
                         y + static_cast<int>(source.height_px), left, bottom, left + width, bottom + height,
                         GL_COLOR_BUFFER_BIT, GL_LINEAR);
}

std::vector<std::uint8_t> read_pixels(GLuint framebuffer, SizePx size) {
  std::vector<std::uint8_t> rgba(bytes_of(size));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadnPixels(0, 0, size.width, size.height, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(rgba.size()),
                rgba.data());
  return rgba;
}

FrameReader::FrameReader(SizePx size, std::size_t max_held, Receiver receiver)
    : size_(size), receiver_(std::move(receiver)), slots_(max_held + kMaxInFlight) {
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
  if (in_flight_.size() == kMaxInFlight) hand_on_oldest();
  Slot& slot = free_slot();
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, slot.buffer.get());
  glReadPixels(0, 0, size_.width, size_.height, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  slot.fence.place();
  in_flight_.push_back(&slot);
}

void FrameReader::finish() {
  while (!in_flight_.empty()) hand_on_oldest();
}

// There is always one: at most max_held are held, and at most kMaxInFlight - 1 are being read.
FrameReader::Slot& FrameReader::free_slot() {
  const auto is_free = [](const Slot& slot) {
    return !slot.fence.placed() && !slot.held.load(std::memory_order_acquire);
  };
  const auto found = std::find_if(slots_.begin(), slots_.end(), is_free);
  if (found == slots_.end()) throw DeviceError("frames: more are kept than were agreed");
  return *found;
}

void FrameReader::hand_on_oldest() {
  Slot& slot = *in_flight_.front();
  in_flight_.pop_front();
  slot.fence.wait();
  slot.held.store(true, std::memory_order_relaxed);
  const auto let_go = [&slot](const void*) { slot.held.store(false, std::memory_order_release); };
  receiver_({{slot.memory, bytes_of(size_)}, std::shared_ptr<const void>(slot.memory, let_go)});
}

}  // namespace pf
