// A film written by an ffmpeg process that is fed raw frames through a pipe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "app/film_writer.hpp"

namespace pf {

// Whether an ffmpeg program is on the PATH.
bool ffmpeg_available();

// The H.264 encoder of the ffmpeg on the PATH: "h264_nvenc" where it encodes a trial film, else "libx264".
// Tried once per PATH.
std::string h264_encoder();

class Encoder final : public FrameSink {
 public:
  // H.264 in a container chosen by the file's ending (.mp4, .mkv), yuv420p so that it plays anywhere. The
  // film stays playable if the program or ffmpeg dies, up to the last whole second that was encoded
  // (fragmented mp4, a key frame every second). Throws UserError if ffmpeg is missing or the file's folder
  // is, and DeviceError if the process cannot be started.
  Encoder(const std::filesystem::path& file, int width_px, int height_px, double frame_rate_hz);
  ~Encoder() override;  // finishes the film
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  // rgba: height * width * 4 bytes, bottom row first (as GL reads it). Throws DeviceError with ffmpeg's last
  // words if the process died.
  void add_frame(std::span<const std::uint8_t> rgba) override;
  // Closes the pipe and waits for ffmpeg; throws DeviceError if it failed.
  void finish() override;
  std::string name() const override;

 private:
  struct Process;
  std::unique_ptr<Process> process_;
};

}  // namespace pf
