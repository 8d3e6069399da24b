#include "app/option_split.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <utility>

#include "app/option_values.hpp"
#include "app/split_setting.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"

namespace pf {
namespace {

// In the order of kSplitViewNames after the first.
const std::vector<std::string> kViewOptions = {"halves", "picture"};

}  // namespace

void add_split_flags(CLI::App& app, Typed& typed) {
  app.add_option("--split", typed.split,
                 fmt::format("fly the launch twice at once with one clock; the second flight differs in this "
                             "setting (may be repeated), without a value in the next method; one of {}",
                             fmt::join(settings_that_may_differ(), ", ")))
      ->type_name("[SECTION.KEY=VALUE]")
      ->allow_extra_args(false);
  add_text(app, "--split-view", typed.split_view, "NAME",
           fmt::format("two flights in two halves or in one picture; {}; default {}",
                       fmt::join(kViewOptions, ", "), kViewOptions.front()));
}

void read_split(const Typed& typed, Options& options) {
  if (!typed.split.empty()) options.split = split_settings(typed.split);
  if (!typed.split_view) return;
  const bool is_halves = name_of("--split-view", *typed.split_view, kViewOptions) == kViewOptions.front();
  options.split_view = kSplitViewNames[is_halves ? 1 : 2];
  if (typed.split.empty() && !typed.replay)
    throw UserError("--split-view: needs --split or the log of two flights; add it");
}

std::string obstacle_to_split(const Options& options) {
  const auto is_svg = [](const std::filesystem::path& file) { return ending_of(file) == ".svg"; };
  const DataOptions& data = options.data;
  for (const auto& [flag, is_given] :
       {std::pair("--dump", !data.dump.empty()), std::pair("--checkpoint", !data.checkpoint.empty()),
        std::pair("--from", !data.from.empty()), std::pair("--picture-size", options.picture_width_px > 0),
        std::pair("--picture-tile", options.picture_tile_px > 0),
        std::pair("--picture-transparent", options.picture_transparent),
        std::pair("--picture with .svg", is_svg(options.picture)),
        std::pair("--still with .svg", is_svg(options.still))}) {
    if (is_given) return fmt::format("--split: {} has one flight only; leave out one of them", flag);
  }
  return "";
}

void check_split_run(const Options& options) {
  const auto begins = [](const LoggedFrame& frame) { return frame.second.split.has_value(); };
  const bool is_in_log =
      options.replay && std::any_of(options.replay->frames.begin(), options.replay->frames.end(), begins);
  if (options.split.empty() && !is_in_log) return;
  const std::string obstacle = obstacle_to_split(options);
  if (!obstacle.empty()) throw UserError(obstacle);
  // --accuracy and cues give the first flight other settings later.
  const auto is_next = [](const std::string& edit) { return edit == kNextMethod; };
  const bool is_known = !options.cues && options.accuracy.error <= 0.0;
  if (options.split.empty() || !is_known || std::any_of(options.split.begin(), options.split.end(), is_next))
    return;
  if (differing(options.settings, options.split) == options.settings)
    throw UserError(fmt::format("--split: {} is what the first flight has; give another value",
                                fmt::join(options.split, ", ")));
}

void refuse_split(const Typed& typed, const std::string& reason) {
  if (!typed.split.empty()) throw UserError(fmt::format("--split: {}", reason));
}

}  // namespace pf
