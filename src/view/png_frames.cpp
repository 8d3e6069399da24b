#include "view/png_frames.hpp"

#include <fmt/format.h>

#include "app/frame_names.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "view/capture.hpp"

namespace pf {

PngFrames::PngFrames(std::filesystem::path pattern, SizePx size) : pattern_(std::move(pattern)), size_(size) {
  const std::filesystem::path folder = pattern_.parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directory(folder, error);
  if (error) {
    throw UserError(
        fmt::format("--record: the folder {} for the frames cannot be made: {}; choose one that can",
                    in_quotes(folder.string()), error.message()));
  }
}

void PngFrames::add_frame(std::span<const std::uint8_t> rgba) {
  write_png(frame_file(pattern_, num_), rgba, size_);
  ++num_;
}

void PngFrames::finish() {
  std::error_code error;
  for (int left_over = num_; std::filesystem::remove(frame_file(pattern_, left_over), error);) ++left_over;
}

}  // namespace pf
