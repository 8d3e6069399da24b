// The command line: CLI11 takes it apart, the table of settings checks it.
#include "app/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>

#include "app/frame_names.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

// Flags that are short for --set; their help and checks come from the table of settings.
struct SettingFlag {
  const char* flag;
  const char* path;
  const char* value;  // as the help names it
};
constexpr SettingFlag kSettingFlags[] = {
    {"-p", "air.num_parcels", "N"},      {"--ball-vx", "ball.vx_mps", "X"},
    {"--ball-vy", "ball.vy_mps", "Y"},   {"--ball-spin", "ball.spin_radps", "OMEGA"},
    {"--method", "run.method", "NAME"},  {"--neighbors", "run.neighbors", "NAME"},
    {"--threads", "run.threads", "N"},   {"--dt", "run.dt_s", "SECONDS"},
    {"--substeps", "run.substeps", "N"}, {"--time-scale", "run.time_scale", "X"},
    {"--seed", "run.seed", "N"},         {"--seconds", "run.seconds", "SECONDS"},
};

const std::vector<std::string> kCommands = {"run", "bench", "scenes", "lab"};
const std::vector<std::string> kStudies = {"validate", "work-precision", "stability", "terms", "all"};
const std::vector<std::string> kRecordTimes = {"simulation", "real"};
const std::vector<std::string> kOnOff = {"on", "off"};
const std::vector<std::string> kDrawTargets = {"auto", "interop", "staged", "host"};
constexpr const char* kForgetting = "/dev/null";  // a film for measuring
constexpr const char* kDefaultScene = "court";
constexpr const char* kBenchScene = "gas";  // its results can be held against theory and other programs

// The command line as typed. Checked afterwards, since --set and flags go on top of the scene wherever they
// stand.
struct Typed {
  std::optional<std::string> scene, accuracy, of, size, steps, warmup, repeats, frames, sweep_max, theme,
      color_map, overlay, ui_scale;
  std::vector<std::string> sets;
  std::vector<std::pair<const SettingFlag*, std::string>> flags;
  std::string record, report, picture, json, panel_map, log, study, overlay_csv, save_scene;
  std::string record_time = "simulation", record_overlay = "on";
  std::optional<std::string> record_size, replay;
  std::vector<std::string> still;
  bool force = false;
};

bool is_num_parcels(const SettingFlag& flag) { return std::string(flag.flag) == "-p"; }

// The row of a flag. For -p without 0, which means 'by backend' in a scene and would be read as 'none' here.
Field field_of(const SettingFlag& flag) {
  Field field = find_field(flag.path, flag.flag);
  if (is_num_parcels(flag)) {
    field.doc = "number of parcels";
    field.min = 1;
  }
  return field;
}

std::string flag_help(const SettingFlag& flag) {
  const Field field = field_of(flag);
  const std::string unit = field.unit.empty() ? "" : " [" + field.unit + "]";
  const auto* choice = std::get_if<Choice>(&field.member);
  const std::string allowed = choice != nullptr ? fmt::format("{}", fmt::join(choice->names, ", "))
                                                : fmt::format("{} to {}", field.min, field.max);
  const Settings defaults;
  const std::string standard =
      is_num_parcels(flag)
          ? fmt::format("{} on a CPU, {} on a GPU", defaults.num_parcels_cpu, defaults.num_parcels_gpu)
          : value_text(field, defaults);
  return fmt::format("{}{}; {}; default {}", field.doc, unit, allowed, standard);
}

std::string set_help() {
  std::string text = "Settings for --set, the keys of a scene file (defaults; a scene may have others):\n";
  for (const Field& field : fields()) {
    const bool is_number =
        field.max > field.min && !std::holds_alternative<std::string Settings::*>(field.member);
    const auto* choice = std::get_if<Choice>(&field.member);
    const std::string range = is_number ? fmt::format(" ({} to {})", field.min, field.max)
                              : choice  ? fmt::format(" ({})", fmt::join(choice->names, ", "))
                                        : "";
    text += fmt::format("  {} = {}{}{}\n      {}\n", field.path(), value_text(field, Settings{}),
                        field.unit.empty() ? "" : " " + field.unit, range, field.doc);
  }
  return text;
}

CLI::Option* add_text(CLI::App& app, const char* flag, std::optional<std::string>& target, const char* value,
                      const std::string& help) {
  // A callback, since CLI11 takes an empty value of an optional for none at all.
  return app
      .add_option_function<std::string>(
          flag, [&target](const std::string& text) { target = text; }, help)
      ->type_name(value);
}

void add_setting_flags(CLI::App& app, Typed& typed, Options& options, const char* default_scene) {
  add_text(app, "--scene", typed.scene, "NAME",
           fmt::format("scene by name (see 'pickleflight scenes') or a file ending in .toml; default {}",
                       default_scene));
  add_text(app, "--accuracy", typed.accuracy, "X%",
           "choose method, time step and number of parcels (unless -p gives it): the cheapest that errs by "
           "at most "
           "this, by the table of 'pickleflight lab work-precision'");
  add_text(app, "--of", typed.of, "WHAT",
           fmt::format("what --accuracy is of; {}; default path if a ball flies, else rate",
                       fmt::join(accuracy_targets(), ", ")));
  for (const SettingFlag& flag : kSettingFlags) {
    const auto keep = [&typed, &flag](const std::string& text) { typed.flags.emplace_back(&flag, text); };
    app.add_option_function<std::string>(flag.flag, keep, flag_help(flag))->type_name(flag.value);
  }
  app.add_option("--set", typed.sets, "any setting, may be repeated; all are listed below")
      ->type_name("SECTION.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_flag("--force", typed.force,
               "let method spring take steps beyond its stability bound: run.allow_unstable = true");
  app.add_flag("--cuda", options.cuda, "compute on the CUDA device; on the CPU, saying so, if there is none");
  app.add_flag("--cuda-no-fallback", options.cuda_no_fallback,
               "as --cuda, but end with an error if there is none");
  app.footer(set_help);
}

void add_frame_flags(CLI::App& app, Typed& typed, Options& options) {
  app.add_option(
         "--draw-target", options.draw_target,
         fmt::format("how parcels reach the renderer; {}; default auto", fmt::join(kDrawTargets, ", ")))
      ->type_name("NAME");
  add_text(app, "--size", typed.size, "WxH",
           "size of window, film and picture [pixels]; each 16 to 16384; default 1280x720");
}

void add_record_flags(CLI::App& app, Typed& typed, Options& options) {
  app.add_option(
         "--record", typed.record,
         "write a film, .mp4 or .mkv, or its frames as FOLDER/%05d.png, or raw as .rgb (RGBA, top row "
         "first); without ffmpeg the frames of NAME.mp4 go to NAME_frames/%05d.png; beside it "
         "FILE.toml, the log of the flight; F9 in the window stops it and starts others")
      ->type_name("FILE");
  app.add_option("--record-time", typed.record_time,
                 "simulation: every frame that is drawn is one of the film; real: one per period of the "
                 "clock, others are repeated or left out; default simulation")
      ->type_name("NAME");
  add_text(app, "--record-size", typed.record_size, "WxH",
           "size of the film, as 1280x720 or 1920x1080; each 16 to 16384 and even; default: the window's");
  app.add_flag("--record-panel", options.record_panel, "with the panel in the film, and in pictures by F12");
  app.add_option("--record-overlay", typed.record_overlay,
                 "whether the film has the overlay; on, off; default on")
      ->type_name("NAME");
  app.add_option("--log", typed.log,
                 "write settings and inputs: 'pickleflight run FILE.toml' flies them again")
      ->type_name("FILE.toml");
}

std::string one_of(const char* what, const std::vector<std::string>& names) {
  return fmt::format("{}; {}; default {}", what, fmt::join(names, ", "), names.front());
}

// What the panel and the keys do to the picture.
void add_stage_flags(CLI::App& app, Typed& typed, Options& options) {
  app.add_flag("--paused", options.paused, "start paused; the space bar starts");
  app.add_flag("--ghosts", options.ghosts,
               "draw the paths of the same launch in a vacuum and in closed-form drag");
  add_text(app, "--theme", typed.theme, "NAME", one_of("colours of floor, panel and overlay", kThemeNames));
  add_text(app, "--color-map", typed.color_map, "NAME",
           one_of("colours of the parcels' speed", kColorMapNames));
  add_text(app, "--overlay", typed.overlay, "NAME",
           one_of("times and figures at the lower edge", kOverlayNames));
  add_text(app, "--ui-scale", typed.ui_scale, "X",
           fmt::format("size of text and overlay; {} to {}; default 1", kLeastUiScale, kMostUiScale));
  app.add_flag_callback(
      "--no-vsync", [&options] { options.vsync = false; }, "frames do not wait for the screen");
  app.add_flag("--full-screen", options.full_screen, "a window that fills the screen");
  app.add_option("--overlay-csv", typed.overlay_csv, "write what the overlay shows, one line per frame")
      ->type_name("FILE");
  app.add_option("--save-scene", typed.save_scene,
                 "write the settings of this command line as a scene file that is not there yet, .toml")
      ->type_name("FILE");
}

void add_run_flags(CLI::App& app, Typed& typed, Options& options) {
  add_stage_flags(app, typed, options);
  app.add_flag("-t", options.show_path, "draw the path of the ball");
  app.add_flag("--headless", options.headless, "no window");
  app.add_flag_callback(
      "--no-panel", [&options] { options.show_panel = false; }, "window without the panel");
  add_record_flags(app, typed, options);
  app.add_option("--panel-map", typed.panel_map, "write where each control of the panel is, as JSON")
      ->type_name("FILE");
  app.add_option("--picture", typed.picture, "write the last frame, .png")->type_name("FILE");
  app.add_option("--still", typed.still,
                 "headless: write the picture at T seconds of simulated time, and end")
      ->type_name("T FILE.png")
      ->expected(2);
  app.add_option("replay", typed.replay, "a log of inputs (--log, or beside a film): the same flight again")
      ->type_name("FILE.toml");
  app.add_option("--report", typed.report, "write figures of the run as JSON")->type_name("FILE.json");
  add_text(app, "--warmup", typed.warmup, "N",
           "frames before those that the report's means are of; 0 to 1000000; default 0");
  add_frame_flags(app, typed, options);
}

void add_lab_flags(CLI::App& app, Typed& typed, Options& options) {
  LabOptions& lab = options.lab;
  app.add_option("study", typed.study, fmt::format("what to measure: {}", fmt::join(kStudies, ", ")))
      ->type_name("NAME");
  app.add_flag("--quick", lab.quick,
               "minutes on 2 cores; validate: two minutes instead of an hour, wider tolerances");
  app.add_option("--json", typed.json, "validate: write the results as JSON")->type_name("FILE");
  app.add_option("--out", lab.out, "folder of the results; default lab-STUDY")->type_name("DIR");
  app.add_option("--scene", lab.scene, "scene of the study of terms; default court")->type_name("NAME");
  app.add_flag("--resume", lab.resume, "go on with what an earlier run left in the folder");
  app.add_flag("--force", lab.force, "measure anew over what is in the folder");
  app.add_flag("--cuda", options.cuda, "also on the CUDA device, as a series of its own");
  app.add_flag("--cuda-no-fallback", options.cuda_no_fallback,
               "as --cuda, but end with an error if there is none");
}

void add_bench_flags(CLI::App& app, Typed& typed, Options& options) {
  add_text(app, "--steps", typed.steps, "N", "timed steps per repeat; 1 to 1000000; default 200");
  add_text(app, "--warmup", typed.warmup, "N", "steps before timing; 0 to 1000000; default 20");
  add_text(app, "--repeats", typed.repeats, "N",
           "repeats, of which median and minimum are given; 1 to 1000; default 5");
  add_text(app, "--frames", typed.frames, "N",
           "time N whole frames instead, drawn offscreen with overlay; 1 to 1000000");
  app.add_flag("--panel", options.bench_panel, "with --frames: draw the panel, too, as a window does");
  app.add_option(
         "--record", typed.record,
         "with --frames: time them also with this film, in turn, and give the ratio; .rgb takes frames "
         "as they are, /dev/null takes and forgets them, .mp4 and .mkv encode; size 1920x1080 unless "
         "--size is given")
      ->type_name("FILE");
  app.add_option("--record-time", typed.record_time,
                 "simulation: every frame is one of the film; real: one per period of the clock; default "
                 "simulation")
      ->type_name("NAME");
  app.add_flag("--sweep", options.sweep,
               "instead: whole frames, drawing included, over N, for every backend and neighbour search");
  add_text(app, "--sweep-max", typed.sweep_max, "N",
           "largest number of parcels of the sweep; 1000 to 100000000; default 1000000");
  add_frame_flags(app, typed, options);
  app.add_option("--json", typed.json, "write the results as JSON")->type_name("FILE");
}

int whole_number(const std::string& place, const std::string& text, int min, int max) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < min || value > max) {
    throw UserError(fmt::format("{}: {} cannot be used; give a whole number from {} to {}", place,
                                in_quotes(text), min, max));
  }
  return value;
}

void read_size(const std::string& flag, const std::string& text, int& width_px, int& height_px) {
  constexpr int kMin = 16, kMax = 16384;
  const std::size_t cross = text.find_first_of("xX");
  try {
    if (cross == std::string::npos) throw UserError("");
    width_px = whole_number(flag, text.substr(0, cross), kMin, kMax);
    height_px = whole_number(flag, text.substr(cross + 1), kMin, kMax);
  } catch (const UserError&) {
    throw UserError(
        fmt::format("{}: {} is not a size; give WIDTHxHEIGHT, each a whole number from {} to {} pixels, "
                    "as 1280x720",
                    flag, in_quotes(text), kMin, kMax));
  }
}

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
    throw UserError(fmt::format("{}; to fly without parcels use --set air.kind=vacuum", error.what()));
  }
}

Settings read_settings(const Typed& typed, const char* default_scene) {
  Settings settings;
  try {
    settings = load_scene(typed.scene.value_or(default_scene));
  } catch (const UserError& error) {
    if (!typed.scene) throw;
    throw UserError(fmt::format("--scene: {}", error.what()));
  }
  for (const std::string& assignment : typed.sets) apply_set(assignment, settings);
  for (const auto& [flag, text] : typed.flags) apply_flag(*flag, text, settings);
  if (typed.force) settings.allow_unstable = true;
  return settings;
}

// Opens in append mode, so that what is there stays; a file that this made is removed again.
void check_writable(const std::string& place, const fs::path& file) {
  std::error_code ignored;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::string reason;
  if (!fs::is_directory(folder, ignored)) {
    reason = fmt::format("the folder {} does not exist", in_quotes(folder.string()));
  } else if (fs::is_directory(file, ignored)) {
    reason = "it is a folder";
  } else if (fs::exists(file, ignored) && !fs::is_regular_file(file, ignored)) {
    if (::access(file.c_str(), W_OK) != 0) reason = std::strerror(errno);  // opening a pipe would wait
  } else {
    const bool is_new = !fs::exists(fs::symlink_status(file, ignored));
    errno = 0;
    if (!std::ofstream(file, std::ios::app))
      reason = std::strerror(errno);
    else if (is_new)
      fs::remove(file, ignored);
  }
  if (reason.empty()) return;
  throw UserError(
      fmt::format("{}: {} cannot be written: {}; choose a file in a folder that exists and is writable",
                  place, in_quotes(file.string()), reason));
}

// The file named by a flag, or none. endings: those allowed; empty: any.
fs::path output_file(const CLI::App& app, const std::string& flag, const std::string& text,
                     const std::vector<std::string>& endings) {
  if (app.get_option_no_throw(flag) == nullptr || app.count(flag) == 0) return {};
  const fs::path file = text;
  const std::string ending = CLI::detail::to_lower(file.extension().string());
  if (!endings.empty() && std::find(endings.begin(), endings.end(), ending) == endings.end()) {
    throw UserError(fmt::format("{}: {} has the wrong ending; the file must end in {}", flag, in_quotes(text),
                                fmt::join(endings, " or ")));
  }
  check_writable(flag, file);
  return file;
}

// A film, or a pattern for its frames, whose folder is made later if the one above it is there.
fs::path record_file(const CLI::App& app, const std::string& text) {
  const fs::path file = text;
  if (!is_frame_pattern(file)) {
    if (CLI::detail::to_lower(file.extension().string()) == ".png") {
      throw UserError(fmt::format(
          "--record: {} has no place for the frame's number; give FOLDER/%05d.png, or a film that "
          "ends in .mp4 or .mkv, or raw frames, .rgb",
          in_quotes(text)));
    }
    return output_file(app, "--record", text, {".mp4", ".mkv", ".rgb"});
  }
  const bool folder_is_new = file.has_parent_path() && !fs::exists(file.parent_path());
  check_writable("--record", folder_is_new ? file.parent_path() : file);
  return file;
}

std::string name_of(const char* flag, const std::string& text, const std::vector<std::string>& names) {
  if (std::find(names.begin(), names.end(), text) != names.end()) return text;
  throw UserError(fmt::format("{}: {} is unknown, the nearest is {}; one of {}", flag, in_quotes(text),
                              nearest_name(text, names), fmt::join(names, ", ")));
}

double read_ui_scale(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() ||
      !(value >= kLeastUiScale && value <= kMostUiScale)) {
    throw UserError(fmt::format("--ui-scale: {} cannot be used; give a number from {} to {}", in_quotes(text),
                                kLeastUiScale, kMostUiScale));
  }
  return value;
}

void read_stage_options(const CLI::App& command, const Typed& typed, Options& options) {
  if (typed.theme) options.theme = name_of("--theme", *typed.theme, kThemeNames);
  if (typed.color_map) options.color_map = name_of("--color-map", *typed.color_map, kColorMapNames);
  if (typed.overlay) options.overlay = name_of("--overlay", *typed.overlay, kOverlayNames);
  if (typed.ui_scale) options.ui_scale = read_ui_scale(*typed.ui_scale);
  if (options.paused && options.headless)
    throw UserError(
        "--paused: a headless run has no space bar that would start it; leave out one of the two");
  options.overlay_csv = output_file(command, "--overlay-csv", typed.overlay_csv, {});
  if (typed.save_scene.empty()) return;
  if (fs::exists(fs::symlink_status(typed.save_scene))) {
    throw UserError(fmt::format("--save-scene: {} is there already and stays as it is; choose another name",
                                in_quotes(typed.save_scene)));
  }
  options.save_scene = output_file(command, "--save-scene", typed.save_scene, {".toml"});
}

bool gives_seconds(const Typed& typed) {
  const auto is_seconds = [](const std::string& path) { return path == "run.seconds"; };
  for (const std::string& set : typed.sets) {
    if (is_seconds(CLI::detail::trim_copy(set.substr(0, set.find('='))))) return true;
  }
  return std::any_of(typed.flags.begin(), typed.flags.end(),
                     [&](const auto& flag) { return is_seconds(flag.first->path); });
}

// What CLI11 did not recognise.
[[noreturn]] void refuse_extra(const CLI::App& command, const std::string& word) {
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    for (const std::string& name : option->get_snames()) known.push_back("-" + name);
  }
  const bool is_option = word.starts_with('-');
  const std::string help = fmt::format("see pickleflight {} --help", command.get_name());
  if (is_option) {
    const std::string name = word.substr(0, word.find('='));
    throw UserError(fmt::format("{} is not an option of 'pickleflight {}'; the nearest is {}; {}",
                                in_quotes(word), command.get_name(), nearest_name(name, known), help));
  }
  if (std::find(kCommands.begin(), kCommands.end(), word) != kCommands.end()) {
    throw UserError(fmt::format("{} must come first: pickleflight {} [options]", in_quotes(word), word));
  }
  throw UserError(
      fmt::format("{} is neither a command nor the value of an option; the nearest command is {} "
                  "(commands: {}); {}",
                  in_quotes(word), nearest_name(word, kCommands), fmt::join(kCommands, ", "), help));
}

// A sweep has settings of its own; others would be dropped in silence.
void check_sweep(const Typed& typed, const Options& options) {
  if (!options.sweep && typed.sweep_max) throw UserError("--sweep-max: goes with --sweep; add it");
  const bool has_others = options.draw_target != "auto" || typed.scene || typed.size || typed.accuracy ||
                          typed.of || typed.frames || typed.steps || typed.warmup || typed.repeats ||
                          !typed.sets.empty() || !typed.flags.empty() || !typed.record.empty() ||
                          options.bench_panel || typed.force;
  if (options.sweep && has_others) {
    throw UserError(
        "--sweep: chooses scene, settings and frames itself; only --sweep-max, --json and --cuda-no-fallback "
        "go with it, leave out the rest");
  }
}

void check_name(const char* flag, const std::string& name, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  throw UserError(fmt::format("{}: {} is unknown, the nearest is {}; one of {}", flag, in_quotes(name),
                              nearest_name(name, known), fmt::join(known, ", ")));
}

// What belongs to whole frames.
void read_frame_bench(const CLI::App& app, const Typed& typed, Options& options) {
  const bool has_record = app.count("--record") > 0;
  if (!typed.frames && (has_record || options.bench_panel)) {
    throw UserError(fmt::format("{}: goes with --frames N, steps alone are not drawn; add it",
                                has_record ? "--record" : "--panel"));
  }
  if (!has_record && app.count("--record-time") > 0)
    throw UserError("--record-time: goes with --record FILE; add it");
  check_name("--record-time", typed.record_time, kRecordTimes);
  options.record_real_time = typed.record_time == "real";
  options.record = typed.record == kForgetting ? fs::path(kForgetting) : record_file(app, typed.record);
  if (!has_record || typed.size) return;
  options.width_px = 1920;
  options.height_px = 1080;
}

// --accuracy chooses what some flags would set.
AccuracyWish accuracy_wish(const Typed& typed) {
  AccuracyWish wish;
  if (!typed.accuracy) {
    if (typed.of) throw UserError("--of: goes with --accuracy; add it, as --accuracy 1%");
    return wish;
  }
  wish.error = read_accuracy("--accuracy", *typed.accuracy);
  wish.of = typed.of.value_or("");
  const std::vector<std::string>& known = accuracy_targets();
  if (typed.of && std::find(known.begin(), known.end(), wish.of) == known.end()) {
    throw UserError(fmt::format("--of: {} is unknown, the nearest is {}; one of {}", in_quotes(wish.of),
                                nearest_name(wish.of, known), fmt::join(known, ", ")));
  }
  for (const auto& [flag, text] : typed.flags) {
    const std::string path = flag->path;
    if (path == "run.method" || path == "run.dt_s" || path == "run.substeps") {
      throw UserError(fmt::format("--accuracy: chooses {} itself; leave out {}", path, flag->flag));
    }
    wish.keep_parcels = wish.keep_parcels || is_num_parcels(*flag);
  }
  return wish;
}

// The study is named here and not by CLI11, so that a wrong one is answered like any other wrong name.
Options lab_options(const CLI::App& command, const Typed& typed, Options options) {
  LabOptions& lab = options.lab;
  if (std::find(kStudies.begin(), kStudies.end(), typed.study) == kStudies.end()) {
    const std::string what = typed.study.empty()
                                 ? "no study is named"
                                 : fmt::format("{} is no study, the nearest is {}", in_quotes(typed.study),
                                               nearest_name(typed.study, kStudies));
    throw UserError(fmt::format("lab: {}; the studies are: {}; as in pickleflight lab validate --quick", what,
                                fmt::join(kStudies, ", ")));
  }
  options.command = Command::lab;
  options.cuda = options.cuda || options.cuda_no_fallback;
  lab.study = typed.study;
  const bool is_validate = lab.study == "validate";
  if (is_validate && (!lab.out.empty() || lab.resume || lab.force || options.cuda)) {
    throw UserError("lab validate: takes --quick and --json only; leave out the rest");
  }
  if (!is_validate && !typed.json.empty())
    throw UserError("--json: goes with validate; the others take --out DIR");
  if (command.count("--scene") > 0 && lab.study != "terms" && lab.study != "all")
    throw UserError("--scene: goes with terms; the other studies have scenes of their own, leave it out");
  if (lab.resume && lab.force) throw UserError("--resume: contradicts --force; give one of them");
  lab.json = output_file(command, "--json", typed.json, {});
  if (lab.out.empty()) lab.out = "lab-" + lab.study;
  return options;
}

void read_record(const CLI::App& app, const Typed& typed, Options& options) {
  check_name("--record-time", typed.record_time, kRecordTimes);
  check_name("--record-overlay", typed.record_overlay, kOnOff);
  options.record_real_time = typed.record_time == "real";
  options.record_overlay = typed.record_overlay == "on";
  if (typed.record_size) {
    read_size("--record-size", *typed.record_size, options.record_width_px, options.record_height_px);
    if (options.record_width_px % 2 != 0 || options.record_height_px % 2 != 0) {
      throw UserError(fmt::format("--record-size: {} has an odd side; a film's sides are even, as 1280x720",
                                  in_quotes(*typed.record_size)));
    }
  }
  options.record = record_file(app, typed.record);
  options.log = output_file(app, "--log", typed.log, {".toml"});
}

void read_still(const Typed& typed, Options& options) {
  if (typed.still.empty()) return;
  double seconds = 0.0;
  const std::string& text = typed.still[0];
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (error != std::errc() || end != text.data() + text.size() || !(seconds >= 0.0 && seconds <= 1e6)) {
    throw UserError(
        fmt::format("--still: {} is not a time; give seconds of simulated time from 0 to 1e6 and "
                    "a file, as --still 0.25 FILE.png",
                    in_quotes(text)));
  }
  options.still = typed.still[1];
  if (CLI::detail::to_lower(options.still.extension().string()) != ".png") {
    throw UserError(fmt::format("--still: {} has the wrong ending; the file must end in .png",
                                in_quotes(typed.still[1])));
  }
  check_writable("--still", options.still);
  options.still_s = seconds;
  options.headless = true;
}

// A log brings its settings, and others would be another flight.
void read_replay(const Typed& typed, Options& options) {
  if (typed.scene || !typed.sets.empty() || !typed.flags.empty() || typed.force || options.still_s) {
    throw UserError(
        fmt::format("{}: a log has its own scene and settings; leave out --scene, --set, --still "
                    "and their short forms (as -p)",
                    in_quotes(*typed.replay)));
  }
  options.replay = read_log(*typed.replay);
  options.settings = options.replay->settings;
}

Options checked_options(const CLI::App& command, const Typed& typed, Options options) {
  const std::vector<std::string> extras = command.remaining();
  if (!extras.empty()) refuse_extra(command, extras.front());
  if (typed.replay && !typed.replay->ends_with(".toml")) refuse_extra(command, *typed.replay);
  if (command.get_name() == "scenes") {
    options.command = Command::scenes;
    return options;
  }
  if (command.get_name() == "lab") return lab_options(command, typed, std::move(options));
  check_name("--draw-target", options.draw_target, kDrawTargets);
  const bool is_bench = command.get_name() == "bench";
  options.command = is_bench ? Command::bench : Command::run;
  options.cuda = options.cuda || options.cuda_no_fallback;
  if (typed.size) read_size("--size", *typed.size, options.width_px, options.height_px);
  if (typed.steps) options.bench_steps = whole_number("--steps", *typed.steps, 1, 1000000);
  if (typed.warmup) {
    (is_bench ? options.bench_warmup : options.warmup_frames) =
        whole_number("--warmup", *typed.warmup, 0, 1000000);
  }
  if (typed.sweep_max) options.sweep_max = whole_number("--sweep-max", *typed.sweep_max, 1000, 100'000'000);
  check_sweep(typed, options);
  if (typed.repeats) options.bench_repeats = whole_number("--repeats", *typed.repeats, 1, 1000);
  if (typed.frames) options.bench_frames = whole_number("--frames", *typed.frames, 1, 1000000);
  options.accuracy = accuracy_wish(typed);
  options.settings = read_settings(typed, is_bench ? kBenchScene : kDefaultScene);
  options.seconds_given = gives_seconds(typed);
  read_stage_options(command, typed, options);
  if (is_bench)
    read_frame_bench(command, typed, options);
  else
    read_record(command, typed, options);
  read_still(typed, options);
  if (typed.replay) read_replay(typed, options);
  options.picture = output_file(command, "--picture", typed.picture, {".png"});
  options.panel_map = output_file(command, "--panel-map", typed.panel_map, {});
  options.report = output_file(command, "--report", typed.report, {});
  options.bench_json = output_file(command, "--json", typed.json, {});
  return options;
}

std::string version_text() {
  return fmt::format("pickleflight {} (CUDA backend: {})", PF_VERSION, PF_HAVE_CUDA ? "yes" : "no");
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// argv without the program's name; 'run' is put in front where no command is given.
std::vector<std::string> words_of(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  const std::vector<std::string> on_their_own = {"-h", "--help", "--version"};
  const auto first_is_in = [&words](const std::vector<std::string>& names) {
    return !words.empty() && std::find(names.begin(), names.end(), words.front()) != names.end();
  };
  if (!first_is_in(kCommands) && !first_is_in(on_their_own)) words.insert(words.begin(), "run");
  return words;
}

}  // namespace

ParseResult parse_options(int argc, const char* const* argv) {
  Typed typed;
  Options options;
  CLI::App app("A pickleball flying through air parcels, with the accuracy measured, shown and chosen.",
               "pickleflight");
  CLI::App& run = *app.add_subcommand("run", "fly, in a window or headless (also without a command)");
  CLI::App& bench = *app.add_subcommand("bench", "time the steps of a scene, without drawing");
  CLI::App& scenes = *app.add_subcommand("scenes", "list the scenes");
  CLI::App& lab =
      *app.add_subcommand("lab", "measure how accurate the methods are, what it costs, where they break");
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text(), "version and backends");
  for (CLI::App* command : {&run, &bench, &scenes, &lab}) {
    command->allow_extras();  // refused later, with the nearest name
    command->set_version_flag("--version", version_text(), "version and backends");
  }
  add_setting_flags(run, typed, options, kDefaultScene);
  add_run_flags(run, typed, options);
  add_setting_flags(bench, typed, options, kBenchScene);
  add_bench_flags(bench, typed, options);
  add_lab_flags(lab, typed, options);

  std::vector<std::string> words = words_of(argc, argv);
  std::reverse(words.begin(), words.end());  // the order that CLI11 wants
  try {
    app.parse(words);
  } catch (const CLI::CallForHelp&) {
    const bool is_general = app.get_subcommands().empty();
    return {std::nullopt, is_general ? app.help() + "\n" + run.help("pickleflight") : app.help(), 0};
  } catch (const CLI::CallForVersion&) {
    return {std::nullopt, version_text() + "\n", 0};
  } catch (const CLI::ParseError& error) {
    throw UserError(fmt::format("{}; see pickleflight --help", one_line(error.what())));
  }
  return {checked_options(*app.get_subcommands().front(), typed, options), "", 0};
}

}  // namespace pf
