#include "app/option_effects.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "core/error.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

// Without a window nobody can turn the profile on. A log or a state has settings of its own.
void check_profile(const Typed& typed, const Options& options) {
  if (options.profile_csv.empty() || !options.headless || typed.replay || typed.from) return;
  bool is_on = options.settings.profile != ProfileAxis::off;
  for (const Cue& cue : cues_of(options)) is_on = is_on || cue.settings.profile != ProfileAxis::off;
  if (!is_on)
    throw UserError(
        "--profile-csv: needs a profile; add one, as --set run.profile=x or --set run.profile=radius");
}

// A setting has one value.
void check_given_once(const Typed& typed) {
  std::vector<GivenSetting> given = given_settings(typed);
  if (typed.force) given.push_back({"run.allow_unstable", "--force"});
  for (auto at = given.begin(); at != given.end(); ++at) {
    const auto again =
        std::find_if(at + 1, given.end(), [&](const auto& other) { return other.path == at->path; });
    if (again != given.end())
      throw UserError(fmt::format("{}: is given twice, {} and {}; leave out one of them", at->path,
                                  at->option, again->option));
  }
}

// Settings of the command line that have no effect beside others. A window can still change those, a second
// flight may differ in them, and a scene file keeps them.
void check_settings(const Typed& typed, const Options& options) {
  const bool is_final = (options.headless || options.command == Command::bench) && options.split.empty();
  if (!is_final || !options.save_scene.empty() || options.cues) return;
  if (gives(typed, "run.displacement_per_step") && gives(typed, "run.dt_s") && options.settings.dt_s > 0.0)
    throw UserError("run.displacement_per_step: has no effect beside a set time step; leave out one of them");
  const bool chooses_steps = options.accuracy.error > 0.0;
  if (gives(typed, "run.time_scale") && paces_by_substeps(options.settings) && !chooses_steps)
    throw UserError(
        "run.time_scale: has no effect where run.dt_s and run.substeps are set; leave it out, or add "
        "--substeps 0");
  if (options.settings.ball_present) return;
  for (const auto& [path, option] : given_settings(typed))
    if (path.starts_with("ball.") && path != "ball.present")
      throw UserError(
          fmt::format("{}: the scene has no ball; leave it out, or add --set ball.present=true", option));
}

// Refuses options that have no effect without a window, or without a file.
void check_without_window(const CLI::App& command, const Typed& typed, const Options& options) {
  if (!options.headless) return;
  const auto refuse = [&](std::initializer_list<const char*> flags, const char* why) {
    for (const char* flag : flags)
      if (command.count(flag) > 0) throw UserError(fmt::format("{}: {}", flag, why));
  };
  refuse({"--full-screen", "--clip", "--clip-format"}, "needs a window, and this run has none; leave it out");
  refuse({"--paused"},
         "only the space bar of a window starts a paused run, and this run has none; leave it out");
  if (options.picture.empty() && !options.still_s)
    refuse({"--picture-size", "--picture-tile", "--picture-transparent"},
           "needs --picture FILE or --still T FILE; add one of them");
  if (options.record.empty()) refuse({"--record-size", "--record-time"}, "needs --record FILE; add it");
  if (options.record.empty() && options.picture.empty() && !options.still_s)
    refuse({"--record-overlay"},
           "needs a picture: --record FILE, --picture FILE or --still T FILE; add one of them");
  if (options.still_s && gives(typed, "run.seconds"))
    throw UserError("run.seconds: --still T FILE ends the run at T; leave out one of them");
}

}  // namespace

std::vector<GivenSetting> given_settings(const Typed& typed) {
  std::vector<GivenSetting> given;
  for (const std::string& set : typed.sets) {
    const std::string path = CLI::detail::trim_copy(set.substr(0, set.find('=')));
    given.push_back({path, "--set " + path});
  }
  for (const auto& [flag, text] : typed.flags) given.push_back({flag->path, flag->flag});
  return given;
}

bool gives(const Typed& typed, const std::string& path) {
  const std::vector<GivenSetting> given = given_settings(typed);
  return std::any_of(given.begin(), given.end(),
                     [&](const GivenSetting& setting) { return setting.path == path; });
}

void check_effects(const CLI::App& command, const Typed& typed, const Options& options) {
  check_given_once(typed);
  check_profile(typed, options);
  check_settings(typed, options);
  if (options.command == Command::run) check_without_window(command, typed, options);
}

}  // namespace pf
