#include "app/option_settings.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "core/error.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

void apply_set(const std::string& assignment, Settings& settings) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos) {
    throw UserError(fmt::format("--set: {} has no '='; give section.key=value, as air.restitution=0.9",
                                in_quotes(assignment)));
  }
  const std::string path = CLI::detail::trim_copy(assignment.substr(0, equals));
  const std::string value = CLI::detail::trim_copy(assignment.substr(equals + 1));
  const Field& field = find_field(path, "--set");
  set_from_text(field, settings, value, "--set " + path);
}

void apply_flag(const SettingFlag& flag, const std::string& text, Settings& settings) {
  try {
    set_from_text(field_of(flag), settings, text, flag.flag);
  } catch (const UserError& error) {
    if (!is_num_parcels(flag)) throw;
    throw UserError(fmt::format("{}; for a flight without parcels use --set air.kind=vacuum", error.what()));
  }
}

void apply_typed(const Typed& typed, Settings& settings) {
  for (const std::string& assignment : typed.sets) apply_set(assignment, settings);
  for (const auto& [flag, text] : typed.flags) apply_flag(*flag, text, settings);
  if (typed.force) settings.allow_unstable = true;
}

}  // namespace

Settings read_settings(const Typed& typed, const char* default_scene) {
  Settings settings;
  try {
    settings = load_scene(typed.scene.value_or(default_scene));
  } catch (const UserError& error) {
    if (!typed.scene) throw;
    throw UserError(fmt::format("--scene: {}", error.what()));
  }
  apply_typed(typed, settings);
  return settings;
}

void read_cues(const Typed& typed, Options& options) {
  if (typed.scene || typed.accuracy)
    throw UserError(fmt::format("--cues: each cue has its own scene and settings; leave out {}",
                                typed.scene ? "--scene" : "--accuracy"));
  try {
    options.cues = load_cue_list(*typed.cues);
  } catch (const UserError& error) {
    throw UserError(fmt::format("--cues: {}", error.what()));
  }
  for (Cue& cue : options.cues->cues) {
    apply_typed(typed, cue.settings);
    try {
      check_cue(cue);
    } catch (const UserError& error) {
      throw UserError(fmt::format("--cues, with the settings of the command line: {}", error.what()));
    }
  }
  options.settings = options.cues->cues.front().settings;
}

}  // namespace pf
