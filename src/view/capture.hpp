// Reads frames back from GL: for a film without stalling, for a picture at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/film_writer.hpp"
#include "view/camera.hpp"
#include "view/context.hpp"
#include "view/gl.hpp"

namespace pf {

// Texts in a PNG, by keyword (at most 79 Latin letters).
using PngTexts = std::vector<std::pair<std::string, std::string>>;

// The text by which a PNG says that this program wrote it.
std::pair<std::string, std::string> software_text();

// Colours of the pixels, as GL leaves them.
enum class PngAlpha { left_out, kept };  // kept: GL's colours are premultiplied by alpha, the PNG's are not

// rgba: height * width * 4 bytes, bottom row first. texts: UTF-8. Throws UserError if the file cannot be
// written.
void write_png(const std::filesystem::path& file, std::span<const std::uint8_t> rgba, SizePx size,
               const PngTexts& texts = {}, PngAlpha alpha = PngAlpha::left_out);

// Copies a region of a framebuffer into `to`, as large as it fits, with black beside it.
void blit_fitting(GLuint from, const ViewRegion& source, const ColorTarget& to);

// Content of a framebuffer now, RGBA8, bottom row first. Waits for GL.
std::vector<std::uint8_t> read_pixels(GLuint framebuffer, SizePx size);

// Reads frames back into pixel-pack buffers that stay mapped. It hands a frame on three frames after the
// request, when GL has finished it, in the buffer that GL wrote. The film's writer reads it there, on its own
// thread.
class FrameReader {
 public:
  using Receiver = std::function<void(HeldFrame frame)>;

  // max_held: frames that the receiver may keep at a time. Allocates max_held + 3 frames here and nothing
  // later. Throws DeviceError if there is no memory.
  FrameReader(SizePx size, std::size_t max_held, Receiver receiver);

  void read(GLuint framebuffer);  // of the size given; may hand on an older frame
  void finish();                  // hands on all that is left, in order

 private:
  static constexpr std::size_t kMaxInFlight = 3;

  struct Slot {
    GlBuffer buffer;
    const std::uint8_t* memory = nullptr;
    GlFence fence;
    std::atomic<bool> held = false;  // by the receiver
  };

  void hand_on_oldest();
  Slot& free_slot();

  SizePx size_;
  Receiver receiver_;
  std::deque<Slot> slots_;
  std::deque<Slot*> in_flight_;  // oldest first
};

}  // namespace pf
