// What leaves the screen: the film or its single frames, and the picture of an instructive frame.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "app/encoder.hpp"
#include "app/options.hpp"
#include "view/capture.hpp"
#include "view/png_frames.hpp"

namespace pf {

class Film {
 public:
  // size: of the first frame; the film keeps it. Without ffmpeg the frames of a film go into a folder, and
  // `announce` (if it is not null) is told.
  Film(const Options& options, SizePx size, const std::function<void(const std::string&)>& announce);

  // Takes the frame in `framebuffer`. A frame of another size (the window was resized) is scaled into the
  // film.
  void add_frame(GLuint framebuffer, SizePx size);
  // Keeps the frame as the one for the picture.
  void keep_for_picture(GLuint framebuffer, SizePx size);
  // Ends the film and writes the picture, if they are asked for.
  void finish();

  bool wanted() const { return reader_.has_value() || !picture_file_.empty(); }
  bool has_picture() const { return kept_.texture() != 0; }

 private:
  std::filesystem::path picture_file_;
  SizePx size_;
  std::unique_ptr<Encoder> encoder_;  // of these two one, or none
  std::optional<PngFrames> frames_;
  std::optional<FrameReader> reader_;
  ColorTarget scaled_;
  ColorTarget kept_;
};

}  // namespace pf
