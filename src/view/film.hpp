// What leaves the screen: the film, and the picture of an instructive frame.
#pragma once

#include <memory>
#include <optional>

#include "app/encoder.hpp"
#include "app/options.hpp"
#include "view/capture.hpp"

namespace pf {

class Film {
 public:
  // size: of the first frame; the film keeps it.
  Film(const Options& options, SizePx size);

  // Takes the frame in `framebuffer`. A frame of another size (the window was resized) is scaled into the
  // film.
  void add_frame(GLuint framebuffer, SizePx size);
  // Keeps the frame as the one for the picture.
  void keep_for_picture(GLuint framebuffer, SizePx size);
  // Ends the film and writes the picture, if they are asked for.
  void finish();

  bool wanted() const { return encoder_ != nullptr || !picture_file_.empty(); }
  bool has_picture() const { return kept_.texture() != 0; }

 private:
  std::filesystem::path picture_file_;
  SizePx size_;
  std::unique_ptr<Encoder> encoder_;
  std::optional<FrameReader> reader_;
  ColorTarget scaled_;
  ColorTarget kept_;
};

}  // namespace pf
