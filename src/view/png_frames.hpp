// A film as a folder of PNG files: where there is no ffmpeg, or where single frames are wanted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "app/film_writer.hpp"
#include "view/context.hpp"

namespace pf {

class PngFrames final : public FrameSink {
 public:
  // pattern: as is_frame_pattern wants it. Makes the folder; throws UserError if it cannot.
  PngFrames(std::filesystem::path pattern, SizePx size);

  // rgba: height * width * 4 bytes, bottom row first. Numbered from 0. Throws UserError if it cannot be
  // written.
  void add_frame(std::span<const std::uint8_t> rgba) override;
  // Removes the frames of a longer, older film that would follow the last one of this.
  void finish() override;
  std::string name() const override { return "png"; }

 private:
  std::filesystem::path pattern_;
  SizePx size_;
  int num_ = 0;
};

}  // namespace pf
