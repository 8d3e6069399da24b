// Frames back from GL: for the film without stalling, for a picture at once.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "view/context.hpp"
#include "view/gl.hpp"

namespace pf {

// What stands in a PNG beside its pixels, by keyword (Latin letters, up to 79).
using PngTexts = std::vector<std::pair<std::string, std::string>>;

// rgba: height * width * 4 bytes, bottom row first. The alpha channel is left out. texts: UTF-8. Throws
// UserError if the file cannot be written.
void write_png(const std::filesystem::path& file, std::span<const std::uint8_t> rgba, SizePx size,
               const PngTexts& texts = {});

// Content of a framebuffer now, RGBA8, bottom row first. Waits for GL.
std::vector<std::uint8_t> read_pixels(GLuint framebuffer, SizePx size);

// Reads frames back through a ring of pixel-pack buffers: a frame is handed on two frames after it was asked
// for, when GL has long finished it.
class FrameReader {
 public:
  using Receiver = std::function<void(std::span<const std::uint8_t> rgba)>;

  FrameReader(SizePx size, Receiver receiver);

  void read(GLuint framebuffer);  // of the size given; may hand on an older frame
  void finish();                  // hands on all that is left, in order

 private:
  struct Slot {
    GlBuffer buffer;
    const std::uint8_t* memory = nullptr;
    GlFence fence;
  };

  void hand_on(Slot& slot);

  SizePx size_;
  Receiver receiver_;
  std::array<Slot, 3> slots_;
  std::size_t next_ = 0;
};

}  // namespace pf
