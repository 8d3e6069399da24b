// Frames back from GL: for the film without stalling, for a picture at once.
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

// Reads frames back into pixel-pack buffers that stay mapped: a frame is handed on two frames after it was
// asked for, when GL has long finished it, in the buffer that GL wrote; whoever writes it to a file reads it
// there, on a thread of its own.
class FrameReader {
 public:
  using Receiver = std::function<void(HeldFrame frame)>;

  // most_held: frames that the receiver may keep at a time. Takes all its memory here: most_held + 3 frames.
  // Throws DeviceError if there is none.
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
