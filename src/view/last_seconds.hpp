// The last seconds of the picture, reduced, in memory; a key writes them as an animated GIF or WebP.
#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/film_writer.hpp"
#include "core/timing.hpp"
#include "view/camera.hpp"
#include "view/capture.hpp"

namespace pf {

// A kept frame, and the time at which it was shown.
struct ClipFrame {
  Clock::time_point shown_at;
  std::shared_ptr<const std::vector<std::uint8_t>> rgba;
};
// Number of times that each frame is repeated at the clip's rate, so that the clip runs in real time.
std::vector<int> times_shown(const std::deque<ClipFrame>& frames, double rate_hz);

// At most kMaxWidth_px x kMaxHeight_px, with the aspect of the source.
SizePx clip_size(SizePx source);

class LastSeconds {
 public:
  static constexpr double kRate_hz = 20.0;  // a GIF counts in hundredths of a second
  static constexpr int kMaxWidth_px = 640;
  static constexpr int kMaxHeight_px = 480;

  // seconds: at most kMaxClip_s, which are 370 MB.
  explicit LastSeconds(int seconds) : seconds_(seconds) {}

  // Starts to keep frames. Until then no work is done and no memory held.
  void switch_on() { is_on_ = true; }
  bool is_on() const { return is_on_; }
  // Keeps no more frames, and frees those that are kept.
  void give_up();

  // Takes the part of the picture that is seen there, if a frame is due by the clock. Reading back does not
  // wait for GL. Throws DeviceError if there is no memory.
  void take(GLuint framebuffer, const ViewRegion& source);
  // Begins to write what is kept; a thread goes on. Throws UserError and DeviceError.
  void write(const std::filesystem::path& file);
  bool is_writing() const { return writer_ != nullptr; }
  // One line, once, when a file is complete or has failed; otherwise "".
  std::string take_news();
  bool failed() const { return failed_; }  // a file broke off
  // Waits for the file.
  void finish();

 private:
  void keep(const HeldFrame& frame);

  int seconds_;
  bool is_on_ = false;
  bool failed_ = false;
  SizePx size_;
  ColorTarget reduced_;
  std::optional<FrameReader> reader_;
  std::deque<Clock::time_point> reading_;  // of the frames that are being read back
  std::optional<Clock::time_point> next_;
  std::deque<ClipFrame> frames_;
  std::filesystem::path file_;
  std::unique_ptr<FilmWriter> writer_;
};

}  // namespace pf
