// A film as a folder of PNG files: without ffmpeg, or for single frames.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "app/film_writer.hpp"
#include "view/context.hpp"

namespace pf {

class PngFrames final : public FrameSink {
 public:
  // pattern: one that is_frame_pattern accepts. Makes the folder; throws UserError if it cannot.
  PngFrames(std::filesystem::path pattern, SizePx size);

  // rgba: height * width * 4 bytes, bottom row first. Numbered from 0. Throws UserError if it cannot be
  // written.
  void add_frame(std::span<const std::uint8_t> rgba) override;
  // Removes this program's frames of an older, longer film of the same size after the last one of this.
  void finish() override;
  std::string name() const override { return "png"; }

 private:
  std::filesystem::path pattern_;
  SizePx size_;
  int num_ = 0;
};

}  // namespace pf
