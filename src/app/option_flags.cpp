#include "app/option_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>

#include "app/accuracy.hpp"
#include "app/key_table.hpp"
#include "app/option_split.hpp"
#include "backend/backend.hpp"

namespace pf {
namespace {

constexpr SettingFlag kSettingFlags[] = {
    {"-p", "air.num_parcels", "N"},      {"--ball-vx", "ball.vx_mps", "X"},
    {"--ball-vy", "ball.vy_mps", "Y"},   {"--ball-spin", "ball.spin_radps", "OMEGA"},
    {"--method", "run.method", "NAME"},  {"--neighbors", "run.neighbors", "NAME"},
    {"--threads", "run.threads", "N"},   {"--dt", "run.dt_s", "SECONDS"},
    {"--substeps", "run.substeps", "N"}, {"--time-scale", "run.time_scale", "X"},
    {"--seed", "run.seed", "N"},         {"--seconds", "run.seconds", "SECONDS"},
};

std::string flag_help(const SettingFlag& flag) {
  const Field field = field_of(flag);
  const std::string unit = field.unit.empty() ? "" : " [" + field.unit + "]";
  const auto* choice = std::get_if<Choice>(&field.member);
  const std::string allowed =
      choice != nullptr ? fmt::format("{}", fmt::join(choice->names, ", ")) : range_text(field);
  const Settings defaults;
  const std::string standard =
      is_num_parcels(flag)
          ? fmt::format("{} on a CPU, {} on a GPU", defaults.num_parcels_cpu, defaults.num_parcels_gpu)
          : value_text(field, defaults);
  return fmt::format("{}{}; {}; default {}", field.doc, unit, allowed, standard);
}

std::string set_help() {
  std::string text = "Settings for --set and scene files, with defaults (a scene may set others):\n";
  for (const Field& field : fields()) {
    const bool is_number =
        field.max > field.min && !std::holds_alternative<std::string Settings::*>(field.member);
    const auto* choice = std::get_if<Choice>(&field.member);
    const std::string range = is_number ? fmt::format(" ({})", range_text(field))
                              : choice  ? fmt::format(" ({})", fmt::join(choice->names, ", "))
                                        : "";
    text += fmt::format("  {} = {}{}{}\n      {}\n", field.path(), value_text(field, Settings{}),
                        field.unit.empty() ? "" : " " + field.unit, range, field.doc);
  }
  return text;
}

void add_frame_flags(CLI::App& app, Typed& typed, Options& options) {
  app.add_option(
         "--draw-target", options.draw_target,
         fmt::format("path of the parcels to the renderer; {}; default auto", fmt::join(kDrawTargets, ", ")))
      ->type_name("NAME");
  add_text(app, "--size", typed.size, "WxH",
           "size of window, film and picture [pixels]; each 16 to 16384; default 1280x720");
}

void add_record_flags(CLI::App& app, Typed& typed, Options& options) {
  app.add_option(
         "--record", typed.record,
         "write a film (.mp4, .mkv), single frames (FOLDER/%05d.png) or raw frames (.rgb: RGBA, top row "
         "first), and the log of the flight beside it, FILE.toml; without ffmpeg the frames of NAME.mp4 go "
         "to NAME_frames/%05d.png; F9 in the window stops the film and starts another")
      ->type_name("FILE");
  app.add_option("--record-time", typed.record_time,
                 "simulation: every drawn frame is one of the film; real: frames are repeated or dropped to "
                 "follow the clock; default simulation")
      ->type_name("NAME");
  add_text(app, "--record-size", typed.record_size, "WxH",
           "size of the film, as 1280x720 or 1920x1080; each 16 to 16384 and even; default: the window's");
  app.add_flag("--record-panel", options.record_panel, "show the panel in the film and in pictures by F12");
  app.add_option("--record-overlay", typed.record_overlay,
                 "show the overlay in the film; on, off; default on")
      ->type_name("NAME");
  app.add_option("--log", typed.log, "write settings and inputs; 'pickleflight run FILE.toml' replays them")
      ->type_name("FILE.toml");
}

std::string one_of(const char* what, const std::vector<std::string>& names) {
  return fmt::format("{}; {}; default {}", what, fmt::join(names, ", "), names.front());
}

// Flags for the picture, as in the panel.
void add_stage_flags(CLI::App& app, Typed& typed, Options& options) {
  add_text(
      app, "--cues", typed.cues, "NAME",
      "prepared states of a talk, by name (talk) or from a file ending in .toml: begins with the first cue, "
      "keys 1 to 9 and page up, page down go to others; without a window all of them fly, one by one");
  app.add_flag("--paused", options.paused, "start paused, until the space bar is pressed");
  add_split_flags(app, typed);
  app.add_flag("--ghosts", options.ghosts,
               "draw the paths of the same launch in vacuum and in closed-form drag");
  add_text(app, "--theme", typed.theme, "NAME", one_of("colours of floor, panel and overlay", kThemeNames));
  add_text(app, "--color-map", typed.color_map, "NAME",
           one_of("colours of the parcels' speed", kColorMapNames));
  add_text(app, "--overlay", typed.overlay, "NAME",
           one_of("overlay of times and figures at the lower edge", kOverlayNames));
  add_text(app, "--ui-scale", typed.ui_scale, "X",
           fmt::format("size of text and overlay; {} to {}; default 1", kMinUiScale, kMaxUiScale));
  add_text(
      app, "--clip", typed.clip, "N",
      fmt::format("keep the last N seconds from the start, for F10; 1 to {}; default 5, kept from the start "
                  "where a GPU draws, else from the first F10",
                  kMaxClip_s));
  add_text(app, "--clip-format", typed.clip_format, "NAME", one_of("animated picture by F10", kClipFormats));
  app.add_flag("--follow", options.follow, "the camera keeps the ball in the middle");
  add_text(
      app, "--magnifier", typed.magnifier, "NAME",
      "a picture of the ball, magnified; auto: while the ball is small; auto, on, off; default: the scene's");
  app.add_flag_callback(
      "--no-vsync", [&options] { options.vsync = false; }, "do not wait for the screen's refresh");
  app.add_flag("--full-screen", options.full_screen, "fill the screen with the window");
  app.add_option("--overlay-csv", typed.overlay_csv, "write the overlay's figures, one line per frame")
      ->type_name("FILE");
  app.add_option("--profile-csv", typed.profile_csv,
                 "write the profile of run.profile, one line per bin and frame")
      ->type_name("FILE");
  app.add_option("--save-scene", typed.save_scene,
                 "write the settings of this command line to a new scene file, .toml")
      ->type_name("FILE");
}

}  // namespace

CLI::Option* add_text(CLI::App& app, const char* flag, std::optional<std::string>& target, const char* value,
                      const std::string& help) {
  // A callback, since CLI11 treats an empty value of an optional as none.
  return app
      .add_option_function<std::string>(
          flag, [&target](const std::string& text) { target = text; }, help)
      ->type_name(value);
}

bool is_num_parcels(const SettingFlag& flag) { return std::string(flag.flag) == "-p"; }

// CLI11 from 2.5 on would wrap the list of settings like a paragraph, and drop its indentation.
template <class Formatter>
void keep_lines_of_footer(Formatter& formatter) {
  if constexpr (requires { formatter.enable_footer_formatting(false); })
    formatter.enable_footer_formatting(false);
}

Field field_of(const SettingFlag& flag) {
  Field field = find_field(flag.path, flag.flag);
  if (is_num_parcels(flag)) {
    field.doc = "number of parcels";
    field.min = 1;
  }
  return field;
}

void add_setting_flags(CLI::App& app, Typed& typed, Options& options, const char* default_scene) {
  add_text(app, "--scene", typed.scene, "NAME",
           fmt::format("scene by name (see 'pickleflight scenes') or a file ending in .toml; default {}",
                       default_scene));
  add_text(
      app, "--accuracy", typed.accuracy, "X%",
      "choose the cheapest method, time step and (without -p) number of parcels with at most this error, "
      "by the table of 'pickleflight lab work-precision'");
  add_text(app, "--of", typed.of, "WHAT",
           fmt::format("quantity for --accuracy; {}; default drag if a ball flies, otherwise rate",
                       fmt::join(accuracy_targets(), ", ")));
  for (const SettingFlag& flag : kSettingFlags) {
    const auto keep = [&typed, &flag](const std::string& text) { typed.flags.emplace_back(&flag, text); };
    app.add_option_function<std::string>(flag.flag, keep, flag_help(flag))->type_name(flag.value);
  }
  app.add_option("--set", typed.sets, "change any setting of the list below; may be repeated")
      ->type_name("SECTION.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_flag("--force", typed.force,
               "allow steps of method spring beyond its stability bound: run.allow_unstable = true");
  app.add_flag(
      "--cuda", options.cuda,
      "compute on the CUDA device, with --domains or mpirun on all of them; if there is none, on the CPU "
      "after a message");
  app.add_flag("--cuda-no-fallback", options.cuda_no_fallback, "as --cuda, but fail without a CUDA device");
  add_text(
      app, "--domains", typed.domains, "K",
      fmt::format("divide the world into K slabs, shared by the processes that mpirun starts, with the same "
                  "result; 1 to {}, a multiple of the processes; default: one for each",
                  kMaxDomains));
  app.add_option(
         "--domain-link", options.domain_link,
         fmt::format("how motion goes between domains on GPUs: {}; host: through the host's memory; direct: "
                     "from GPU to GPU, by NCCL between processes; auto: direct where that can be",
                     fmt::join(kDomainLinks, ", ")))
      ->type_name("NAME");
  app.footer(set_help);
  keep_lines_of_footer(*app.get_formatter());
}

void add_run_flags(CLI::App& app, Typed& typed, Options& options) {
  add_stage_flags(app, typed, options);
  app.footer([] { return key_help() + "\n" + set_help(); });
  app.add_flag("-t", options.show_path, "draw the path of the ball");
  app.add_flag("--headless", options.headless, "run without a window");
  app.add_flag_callback(
      "--no-panel", [&options] { options.show_panel = false; }, "hide the panel");
  add_record_flags(app, typed, options);
  app.add_option(
         "--panel-map", typed.panel_map,
         "write the positions of the panel's controls as JSON, and the number of frames drawn to FILE.frames")
      ->type_name("FILE");
  add_picture_flags(app, typed, options);
  app.add_option("replay", typed.replay, "replay a log of inputs (written by --log, or beside a film)")
      ->type_name("FILE.toml");
  app.add_option("--report", typed.report, "write figures of the run as JSON")->type_name("FILE.json");
  add_text(app, "--warmup", typed.warmup, "N",
           "frames excluded from the report's means; 0 to 1000000; default 0");
  add_frame_flags(app, typed, options);
}

void add_lab_flags(CLI::App& app, Typed& typed, Options& options) {
  LabOptions& lab = options.lab;
  app.add_option("study", typed.study, fmt::format("study: {}", fmt::join(kStudies, ", ")))
      ->type_name("NAME");
  app.add_option("folder", typed.folder, "plot: folder with results to draw")->type_name("DIR");
  app.add_flag("--quick", lab.quick,
               "take minutes on 2 cores; validate: half a minute instead of a quarter of an hour, with wider "
               "tolerances");
  app.add_option("--json", typed.json, "validate: write the results as JSON")->type_name("FILE");
  app.add_option("--out", lab.out, "folder of the results; default lab-STUDY, for validate none")
      ->type_name("DIR");
  app.add_option("--scene", lab.scene,
                 "scene of the study of terms, flown with 20000 parcels (--quick: 4000); default court")
      ->type_name("NAME");
  app.add_flag("--resume", lab.resume, "continue an earlier run in the folder");
  app.add_flag("--force", lab.force, "overwrite an earlier run in the folder");
  app.add_flag("--cuda", options.cuda, "measure a second series on the CUDA device");
  app.add_flag("--cuda-no-fallback", options.cuda_no_fallback, "as --cuda, but fail without a CUDA device");
}

void add_bench_flags(CLI::App& app, Typed& typed, Options& options) {
  add_text(app, "--steps", typed.steps, "N", "timed steps per repeat; 1 to 1000000; default 200");
  add_text(app, "--warmup", typed.warmup, "N", "steps before timing; 0 to 1000000; default 20");
  add_text(app, "--repeats", typed.repeats, "N", "repeats, for median and minimum; 1 to 1000; default 5");
  add_text(app, "--frames", typed.frames, "N",
           "time N whole frames instead, drawn offscreen with overlay; 1 to 1000000");
  app.add_flag(
      "--flight", options.bench_flight,
      "time every frame of a whole flight instead, without drawing: until the ball leaves, for "
      "--seconds, or for 6 s where no ball leaves; src/lab/plots/flight.py draws the results of --json");
  app.add_flag("--panel", options.bench_panel, "with --frames: draw the panel, too");
  app.add_option(
         "--record", typed.record,
         "with --frames: time them in turn without and with this film, and print the ratio; .rgb stores raw "
         "frames, /dev/null drops them, .mp4 and .mkv encode them; size 1920x1080 unless --size is given")
      ->type_name("FILE");
  app.add_option("--record-time", typed.record_time,
                 "simulation: every frame is one of the film; real: frames follow the clock; default "
                 "simulation")
      ->type_name("NAME");
  app.add_flag("--sweep", options.sweep,
               "time whole frames over N instead, for every backend and neighbour search");
  add_text(app, "--sweep-max", typed.sweep_max, "N",
           "largest number of parcels of the sweep; 1000 to 100000000; default 1000000");
  add_frame_flags(app, typed, options);
  app.add_option("--json", typed.json, "write the results as JSON")->type_name("FILE");
}

}  // namespace pf
