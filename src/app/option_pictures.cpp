// Options for pictures.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "app/option_flags.hpp"
#include "app/option_values.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"

namespace pf {

void add_picture_flags(CLI::App& app, Typed& typed, Options& options) {
  app.add_option("--picture", typed.picture,
                 "write the last frame, of the first flight if the ball leaves: .png, or its court, paths and "
                 "ball, .svg")
      ->type_name("FILE");
  add_text(
      app, "--picture-size", typed.picture_size, "WxH",
      "size of pictures, as 7680x4320: the film's picture enlarged, drawn in tiles where GL's images are "
      "smaller; each 16 to 16384; default: the window's");
  add_text(app, "--picture-tile", typed.picture_tile, "N",
           "largest side of such a tile [pixels]; 16 to 16384; default: what GL allows, at most 4096");
  app.add_flag("--picture-transparent", options.picture_transparent,
               "pictures without ground, overlay and legend: lines, parcels, paths and ball");
  app.add_option(
         "--still", typed.still,
         "headless: write the picture at T seconds of simulated time, then exit; .png, or .svg for paths")
      ->type_name("T FILE")
      ->expected(2);
}

namespace {

void read_still(const Typed& typed, Options& options) {
  if (typed.still.empty()) return;
  const std::string& text = typed.still[0];
  const std::optional<double> seconds = number_in(text);
  if (!seconds || !(*seconds >= 0.0 && *seconds <= 1e6)) {
    throw UserError(
        fmt::format("--still: {} is not a time; give seconds of simulated time from 0 to 1e6 and "
                    "a file, as --still 0.25 FILE.png",
                    in_quotes(text)));
  }
  options.still = typed.still[1];
  const std::string ending = ending_of(options.still);
  if (ending != ".png" && ending != ".svg") {
    throw UserError(fmt::format("--still: {} has the wrong ending; the file must end in .png or .svg",
                                in_quotes(typed.still[1])));
  }
  check_writable("--still", options.still);
  options.still_s = seconds;
  options.headless = true;
}

}  // namespace

void read_pictures(const CLI::App& command, const Typed& typed, Options& options) {
  read_still(typed, options);
  options.picture = output_file(command, "--picture", typed.picture, {".png", ".svg"});
  if (typed.picture_size)
    read_size("--picture-size", *typed.picture_size, options.picture_width_px, options.picture_height_px);
  if (typed.picture_tile)
    options.picture_tile_px = whole_number("--picture-tile", *typed.picture_tile, 16, 16384);
}

}  // namespace pf
