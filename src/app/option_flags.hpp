// Commands and flags of the command line with their help, and the text given to each.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/options.hpp"
#include "scene/settings.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace pf {

// A short form of --set. Its help and checks come from the table of settings.
struct SettingFlag {
  const char* flag;
  const char* path;
  const char* value;  // its name in the help
};

inline const std::vector<std::string> kCommands = {"run", "bench", "scenes", "lab"};
inline const std::vector<std::string> kStudies = {"validate", "work-precision", "stability", "contact-clock",
                                                  "terms",    "gas-dynamics",   "all",       "plot"};
inline const std::vector<std::string> kRecordTimes = {"simulation", "real"};
inline const std::vector<std::string> kOnOff = {"on", "off"};
inline const std::vector<std::string> kDomainLinks = {"auto", "host", "direct"};
inline const std::vector<std::string> kDrawTargets = {"auto", "interop", "staged", "host", "images"};
constexpr const char* kDefaultScene = "court";
constexpr const char* kBenchScene = "gas";  // comparable with theory and other programs

// The command line as typed. It is checked later: --set and flags override the scene in any order.
struct Typed {
  std::optional<std::string> scene, accuracy, of, size, steps, warmup, repeats, frames, sweep_max, theme,
      color_map, overlay, ui_scale, domains, clip, clip_format, magnifier, picture_size, picture_tile;
  std::vector<std::string> sets;
  std::vector<std::pair<const SettingFlag*, std::string>> flags;
  std::string record, report, picture, json, panel_map, log, study, folder, overlay_csv, profile_csv,
      save_scene;
  std::string record_time = "simulation", record_overlay = "on";
  std::optional<std::string> record_size, replay, cues, split_view;
  std::vector<std::string> still, split;
  std::string dump, checkpoint;
  std::optional<std::string> dump_every, dump_fields, dump_compression, checkpoint_every, from, from_frame;
  bool force = false;
};

bool is_num_parcels(const SettingFlag& flag);

// The field of a flag. That of -p excludes 0, which means 'by backend' in a scene but reads like 'none' here.
Field field_of(const SettingFlag& flag);

// Flags of the commands. Their values go to `typed`, or to `options` if they need no check. Both must outlive
// the parse.
void add_setting_flags(CLI::App& app, Typed& typed, Options& options, const char* default_scene);
// Adds a flag whose text may be empty.
CLI::Option* add_text(CLI::App& app, const char* flag, std::optional<std::string>& target, const char* value,
                      const std::string& help);
// Add the options of pictures, and read their values.
void add_picture_flags(CLI::App& app, Typed& typed, Options& options);
void read_pictures(const CLI::App& command, const Typed& typed, Options& options);
void add_run_flags(CLI::App& app, Typed& typed, Options& options);
void add_lab_flags(CLI::App& app, Typed& typed, Options& options);
void add_bench_flags(CLI::App& app, Typed& typed, Options& options);

}  // namespace pf
