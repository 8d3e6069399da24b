// A film, encoded by an ffmpeg process that receives raw frames through a socket.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "app/film_writer.hpp"

namespace pf {

// True if an ffmpeg program is on the PATH.
bool ffmpeg_available();

// H.264 encoder of the ffmpeg on the PATH: "h264_nvenc" if it can encode a trial film, otherwise "libx264".
// The trial is made once per PATH.
std::string h264_encoder();

class Encoder final : public FrameSink {
 public:
  // The file's ending chooses: an animated picture (.gif, .webp), or H.264 (.mp4, .mkv) in yuv420p, which all
  // players support. If the program or ffmpeg dies, H.264 stays playable up to the last whole second that was
  // encoded (fragmented mp4, a key frame every second). Throws UserError for another ending or if ffmpeg or
  // the file's folder is missing, and DeviceError if the process cannot be started.
  Encoder(const std::filesystem::path& file, int width_px, int height_px, double frame_rate_hz);
  ~Encoder() override;  // finishes the film
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  // rgba: height * width * 4 bytes, bottom row first (as GL reads it). Throws DeviceError with ffmpeg's last
  // errors if the process died.
  void add_frame(std::span<const std::uint8_t> rgba) override;
  // Closes the socket and waits for ffmpeg. Throws DeviceError if it failed.
  void finish() override;
  std::string name() const override;

 private:
  struct Process;
  std::unique_ptr<Process> process_;
};

}  // namespace pf
