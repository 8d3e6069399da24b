#include "view/png_frames.hpp"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <fstream>
#include <string_view>

#include "app/frame_names.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "view/capture.hpp"

namespace pf {
namespace {

// Returns whether a file is a frame of that size by this program: a PNG whose header, IHDR, is followed by
// the text that add_frame writes.
bool is_own_frame(const std::filesystem::path& file, SizePx size) {
  constexpr std::string_view kSoftware("tEXtSoftware\0pickleflight ", 26);
  std::array<unsigned char, 37 + kSoftware.size()> head{};
  std::ifstream in(file, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return false;
  const auto number_at = [&](std::size_t at) {
    return head[at] << 24 | head[at + 1] << 16 | head[at + 2] << 8 | head[at + 3];
  };
  return std::memcmp(head.data(), "\x89PNG\r\n\x1a\n", 8) == 0 && number_at(16) == size.width &&
         number_at(20) == size.height && std::memcmp(&head[37], kSoftware.data(), kSoftware.size()) == 0;
}

}  // namespace

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
  write_png(frame_file(pattern_, num_), rgba, size_, {software_text()});
  ++num_;
}

void PngFrames::finish() {
  if (num_ == 0) return;  // there is no film instead of the older one
  std::error_code error;
  for (int left_over = num_; is_own_frame(frame_file(pattern_, left_over), size_); ++left_over) {
    if (!std::filesystem::remove(frame_file(pattern_, left_over), error)) return;
  }
}

}  // namespace pf
