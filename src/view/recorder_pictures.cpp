// Pictures of a recorder: by a key, of the end of the first flight, and of the last frame.
#include <fmt/format.h>

#include "app/frame_names.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"
#include "view/path_svg.hpp"
#include "view/recorder.hpp"

namespace pf {

namespace fs = std::filesystem;

void Recorder::take_requested(std::string_view ending, const SeenPicture& picture,
                              const Simulation& simulation, const PictureScene& scene) {
  const std::string name = fmt::format("{}_t{:.4f}s.{}", file_part(simulation.settings().name),
                                       simulation.view().simulated_s, ending);
  const fs::path file = free_name(name);
  try {
    if (ending == "svg") {
      write_svg(file, path_svg(simulation.view(), scene.look));
    } else if (draws_pictures()) {
      write_picture(file, draw_picture(scene), simulation);
    } else {
      write_picture(file, {read_pixels(picture.framebuffer, picture.size), picture.size}, simulation);
    }
    tell(fmt::format("picture {}", in_quotes(file.string())));
  } catch (const std::exception& error) {  // a file, memory or GL: the run goes on
    failed_ = true;
    tell(reason_of(error));
  }
}

// Pictures that are not those of the window, or of the film.
bool Recorder::draws_pictures() const {
  return options_.picture_width_px > 0 || options_.picture_transparent || options_.picture_tile_px > 0;
}

Pixels Recorder::draw_picture(const PictureScene& scene) const {
  LargePictureRequest request = {seen_, options_.picture_tile_px, options_.picture_transparent};
  if (options_.picture_width_px > 0) request.size = {options_.picture_width_px, options_.picture_height_px};
  return draw_large_picture(request, scene);
}

// --picture takes the last frame of the first flight, which shows the whole path, or the last frame of a run
// without a flight; --still takes the last frame. Pictures of another size are drawn once, when the first
// flight has ended or else at the end of the run.
void Recorder::keep(const SeenPicture& seen, const Simulation& simulation, const PictureScene& large) {
  if (simulation.finished_flight() && !options_.picture.empty()) {
    if (kept_svg_.empty()) kept_svg_ = path_svg(simulation.view(), large.look);
    const double kept_s = draws_pictures() ? simulation.view().simulated_s : kept_s_;
    if (kept_texts_.empty()) kept_texts_ = texts_of(simulation, kept_s);
    const bool is_png = ending_of(options_.picture) != ".svg";
    if (is_png && draws_pictures() && kept_large_.rgba.empty()) {
      FrameView flying = *large.frame;  // without the notice of its end
      flying.flight = Flight::flying;
      PictureScene scene = large;
      scene.frame = &flying;
      kept_large_ = draw_picture(scene);
    }
  }
  if (draws_pictures()) return;
  const auto copy_to = [&seen](ColorTarget& to) {
    const auto [width, height] = seen.size;
    to.resize(width, height);
    glBlitNamedFramebuffer(seen.framebuffer, to.framebuffer(), 0, 0, width, height, 0, 0, width, height,
                           GL_COLOR_BUFFER_BIT, GL_NEAREST);
  };
  if (options_.still_s) copy_to(last_);
  const bool has_flown = !kept_svg_.empty() && kept_.texture() != 0;
  if (options_.picture.empty() || has_flown) return;
  copy_to(kept_);
  kept_s_ = simulation.view().simulated_s;
}

void Recorder::write_picture(const std::filesystem::path& file, const Pixels& picture,
                             const Simulation& simulation) const {
  write_png(file, picture.rgba, picture.size, texts_of(simulation, simulation.view().simulated_s),
            picture.alpha);
}

PngTexts Recorder::texts_of(const Simulation& simulation, double simulated_s) const {
  const FrameView& view = simulation.view();
  Settings settings = simulation.settings();
  if (options_.still_s) {  // of the frames before the last
    settings.time_scale = options_.settings.time_scale;
    settings.substeps = options_.settings.substeps;
  }
  return {software_text(),
          {"Scene", scene_text(settings)},
          {"Simulated time", fmt::format("{} s", simulated_s)},
          {"Backend", view.backend}};
}

void Recorder::write_last(const fs::path& file, bool is_first_flight, const Simulation& simulation,
                          const PictureScene& scene) const {
  const bool has_kept = is_first_flight && !kept_svg_.empty();
  if (ending_of(file) == ".svg")
    return write_svg(file, has_kept ? kept_svg_ : path_svg(simulation.view(), scene.look));
  Pixels picture;
  if (draws_pictures()) {
    picture = has_kept ? kept_large_ : draw_picture(scene);
  } else if (const ColorTarget& kept = is_first_flight ? kept_ : last_; kept.texture() != 0) {
    const SizePx size = {kept.width_px(), kept.height_px()};
    picture = {read_pixels(kept.framebuffer(), size), size};
  }
  if (picture.rgba.empty()) return;
  write_png(file, picture.rgba, picture.size,
            has_kept ? kept_texts_ : texts_of(simulation, simulation.view().simulated_s), picture.alpha);
}

}  // namespace pf
