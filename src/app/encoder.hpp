// A film written by an ffmpeg process that is fed raw frames through a pipe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

namespace pf {

// Whether an ffmpeg program is on the PATH.
bool ffmpeg_available();

class Encoder {
 public:
  // H.264 in a container chosen by the file's ending (.mp4, .mkv), yuv420p so that it plays anywhere. The
  // film stays playable if the program dies (fragmented mp4). Throws UserError if ffmpeg is missing or the
  // file's folder is, and DeviceError if the process cannot be started.
  Encoder(const std::filesystem::path& file, int width_px, int height_px, double frame_rate_hz);
  ~Encoder();  // finishes the film
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  // rgba: height * width * 4 bytes, bottom row first (as GL reads it). Throws DeviceError with ffmpeg's last
  // words if the process died.
  void add_frame(std::span<const std::uint8_t> rgba);
  // Closes the pipe and waits for ffmpeg; throws DeviceError if it failed.
  void finish();

 private:
  struct Process;
  std::unique_ptr<Process> process_;
};

}  // namespace pf
