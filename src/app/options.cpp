// The command line: CLI11 splits it, and the table of settings checks it.
#include "app/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "app/option_bench.hpp"
#include "app/option_data.hpp"
#include "app/option_effects.hpp"
#include "app/option_flags.hpp"
#include "app/option_settings.hpp"
#include "app/option_split.hpp"
#include "app/option_values.hpp"
#include "app/output_clash.hpp"
#include "app/split_setting.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

void read_stage_options(const CLI::App& command, const Typed& typed, Options& options) {
  if (typed.theme) options.theme = name_of("--theme", *typed.theme, kThemeNames);
  if (typed.color_map) options.color_map = name_of("--color-map", *typed.color_map, kColorMapNames);
  if (typed.overlay) options.overlay = name_of("--overlay", *typed.overlay, kOverlayNames);
  if (typed.clip) options.clip_s = whole_number("--clip", *typed.clip, 1, kMaxClip_s);
  options.keep_clip = typed.clip.has_value();
  if (typed.clip_format) options.clip_format = name_of("--clip-format", *typed.clip_format, kClipFormats);
  if (typed.magnifier) options.magnifier = name_of("--magnifier", *typed.magnifier, kMagnifierNames);
  if (typed.ui_scale) options.ui_scale = read_ui_scale(*typed.ui_scale);
  options.overlay_csv = table_file(command, "--overlay-csv", typed.overlay_csv, ".csv");
  options.profile_csv = table_file(command, "--profile-csv", typed.profile_csv, ".csv");
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(typed.save_scene, ignored))) {
    throw UserError(fmt::format("--save-scene: {} already exists and is not overwritten; choose another name",
                                in_quotes(typed.save_scene)));
  }
  options.save_scene = output_file(command, "--save-scene", typed.save_scene, {".toml"});
}

// True for settings of the method that --accuracy chooses.
bool is_chosen(const std::string& path) {
  return path == "run.method" || path == "run.dt_s" || path == "run.substeps" ||
         path == "run.displacement_per_step" || path == "run.spring_contact_s";
}

// Reads --accuracy and --of, and refuses settings that --accuracy chooses.
AccuracyWish accuracy_wish(const Typed& typed) {
  AccuracyWish wish;
  if (!typed.accuracy) {
    if (typed.of) throw UserError("--of: needs --accuracy; add it, as --accuracy 1%");
    return wish;
  }
  wish.error = read_accuracy("--accuracy", *typed.accuracy);
  wish.of = typed.of.value_or("");
  if (typed.of) check_name("--of", wish.of, accuracy_targets());
  for (const auto& [path, option] : given_settings(typed)) {
    if (is_chosen(path))
      throw UserError(fmt::format("--accuracy: chooses {} itself; leave out {}", path, option));
    wish.keep_parcels = wish.keep_parcels || path.starts_with("air.num_parcels");
  }
  return wish;
}

Options plot_options(const CLI::App& command, const Typed& typed, Options options) {
  if (typed.folder.empty() || command.count_all() > 3) {
    throw UserError("lab plot: takes only the folder of the results, as pickleflight lab plot lab-all");
  }
  options.lab.out = typed.folder;
  return options;
}

// The study is checked here and not by CLI11, so that a wrong name gets the usual message.
Options lab_options(const CLI::App& command, const Typed& typed, Options options) {
  LabOptions& lab = options.lab;
  if (std::find(kStudies.begin(), kStudies.end(), typed.study) == kStudies.end()) {
    const std::string what = typed.study.empty()
                                 ? "the study is missing"
                                 : fmt::format("{} is not a study{}", in_quotes(typed.study),
                                               say_nearest(", the nearest is ", typed.study, kStudies));
    throw UserError(fmt::format("lab: {}; the studies are: {}; as in pickleflight lab validate --quick", what,
                                fmt::join(kStudies, ", ")));
  }
  options.command = Command::lab;
  options.cuda = options.cuda || options.cuda_no_fallback;
  lab.study = typed.study;
  const bool is_validate = lab.study == "validate";
  if (lab.study == "plot") return plot_options(command, typed, std::move(options));
  if (!typed.folder.empty()) refuse_extra(command, typed.folder);
  if (is_validate && options.cuda)
    throw UserError(
        "lab validate: has no CUDA series, since tests/gpu compare the device with the CPU bit for bit; "
        "leave out --cuda");
  if (is_validate && lab.out.empty() && (lab.resume || lab.force))
    throw UserError("lab validate: prints its table and writes no folder; give --out DIR as well");
  if (!typed.json.empty() && (!is_validate || !lab.out.empty()))
    throw UserError(
        "--json: needs validate without --out; the folder of --out contains the JSON; leave it out");
  if (command.count("--scene") > 0 && lab.study != "terms" && lab.study != "all")
    throw UserError("--scene: needs terms or all; the other studies have their own scenes; leave it out");
  if (lab.resume && lab.force) throw UserError("--resume: contradicts --force; give one of them");
  lab.json = table_file(command, "--json", typed.json, ".json");
  if (lab.out.empty() && !is_validate) lab.out = "lab-" + lab.study;
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

// Returns whether a log changes the number of threads, which restarts the time of `exact`.
bool changes_threads(const RunLog& log) {
  return std::any_of(log.frames.begin(), log.frames.end(), [](const LoggedFrame& frame) {
    const auto is_of_threads = [](const std::string& edit) { return edit.starts_with("run.threads"); };
    return frame.restart || std::any_of(frame.edits.begin(), frame.edits.end(), is_of_threads);
  });
}

void set_threads(const Typed& typed, Options& options) {
  if (!gives(typed, "run.threads")) return;
  if (changes_threads(*options.replay))
    throw UserError(fmt::format("--threads: {} changes scene or threads on its way; leave it out",
                                in_quotes(*typed.replay)));
  options.replay->settings.threads = options.settings.threads;
  if (!options.replay->from.empty())
    options.data.from_edits.push_back(edit_text(find_field("run.threads", "--threads"), options.settings));
}

// A log contains its settings. With others the flight would differ, but not with another number of threads.
void read_replay(const Typed& typed, Options& options) {
  if (is_cue_list(*typed.replay))
    throw UserError(fmt::format("{0}: is a list of cues; start it with --cues {0}", *typed.replay));
  std::vector<std::string> others;
  for (const auto& [is_given, option] :
       {std::pair(typed.scene.has_value(), "--scene"), std::pair(typed.cues.has_value(), "--cues"),
        std::pair(typed.accuracy.has_value(), "--accuracy"), std::pair(typed.force, "--force"),
        std::pair(options.still_s.has_value(), "--still")}) {
    if (is_given) others.emplace_back(option);
  }
  for (const GivenSetting& setting : given_settings(typed)) {
    if (setting.path != "run.threads") others.push_back(setting.option);
  }
  if (!others.empty()) {
    throw UserError(fmt::format("{}: a log has its own scene and settings; leave out {}",
                                in_quotes(*typed.replay), fmt::join(others, ", ")));
  }
  refuse_split(typed, "a log of two flights has its own; leave it out");
  options.replay = read_log(*typed.replay);
  set_threads(typed, options);
  options.settings = options.replay->settings;
  options.data.from = options.replay->from;
  options.data.from_frame = options.replay->from_frame;
}

Options checked_options(const CLI::App& command, const Typed& typed, Options options) {
  const std::vector<std::string> extras = command.remaining();
  if (!extras.empty()) refuse_extra(command, extras.front());
  if (typed.replay && ending_of(*typed.replay) != ".toml") refuse_extra(command, *typed.replay);
  if (command.get_name() == "scenes") {
    options.command = Command::scenes;
    return options;
  }
  if (command.get_name() == "lab") return lab_options(command, typed, std::move(options));
  check_name("--draw-target", options.draw_target, kDrawTargets);
  check_name("--domain-link", options.domain_link, kDomainLinks);
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
  check_sweep(command, typed, options);
  if (typed.domains) options.domains = whole_number("--domains", *typed.domains, 1, kMaxDomains);
  if (typed.repeats) options.bench_repeats = whole_number("--repeats", *typed.repeats, 1, 1000);
  if (typed.frames) options.bench_frames = whole_number("--frames", *typed.frames, 1, 1000000);
  options.accuracy = accuracy_wish(typed);
  if (typed.cues)
    read_cues(typed, options);
  else
    options.settings = read_settings(typed, is_bench ? kBenchScene : kDefaultScene);
  options.seconds_given = gives(typed, "run.seconds");
  read_stage_options(command, typed, options);
  if (is_bench)
    read_frame_bench(command, typed, options);
  else
    read_record(command, typed, options);
  read_pictures(command, typed, options);
  if (!is_bench) read_data_options(command, typed, options);
  read_split(typed, options);
  if (typed.replay) read_replay(typed, options);
  check_split_run(options);
  check_effects(command, typed, options);
  options.panel_map = output_file(command, "--panel-map", typed.panel_map, {});
  options.report = table_file(command, "--report", typed.report, ".json");
  options.bench_json = table_file(command, "--json", typed.json, ".json");
  check_outputs(typed, options);
  return options;
}

std::string version_text() {
  const auto word = [](bool is_there) { return is_there ? "yes" : "no"; };
  return fmt::format("pickleflight {} (CUDA backend: {}, HDF5: {}, MPI: {}, NCCL: {})", PF_VERSION,
                     word(PF_HAVE_CUDA), word(PF_HAVE_HDF5), word(PF_HAVE_MPI), PF_NCCL_VERSION);
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// CLI11 counts the values of an option in words of its own.
std::string mismatch_text(const CLI::App& command, const std::string& what) {
  const std::string name = what.substr(0, what.find(':'));
  const CLI::Option* option = command.get_option_no_throw(name);
  const int num = option != nullptr ? option->get_items_expected_max() : 0;
  if (num < 1 || num > 9 || what.find(" but received ") == std::string::npos)
    return fmt::format("{}; see pickleflight --help", one_line(what));
  return fmt::format("{}: takes {} value{}, and may be given once; see pickleflight --help", name, num,
                     num == 1 ? "" : "s");
}

// argv without the program's name. Without a command, 'run' is inserted.
std::vector<std::string> arguments_of(int argc, const char* const* argv) {
  std::vector<std::string> all(argv + std::min(argc, 1), argv + argc);
  const std::vector<std::string> global_flags = {"-h", "--help", "--version"};
  const auto first_is_in = [&all](const std::vector<std::string>& names) {
    return !all.empty() && std::find(names.begin(), names.end(), all.front()) != names.end();
  };
  if (!first_is_in(kCommands) && !first_is_in(global_flags)) all.insert(all.begin(), "run");
  return all;
}

}  // namespace

std::span<const Cue> cues_of(const Options& options) {
  return options.cues ? std::span<const Cue>(options.cues->cues) : std::span<const Cue>();
}

ParseResult parse_options(int argc, const char* const* argv) {
  Typed typed;
  Options options;
  CLI::App app("A pickleball flying through air parcels, with the accuracy measured, shown and chosen.",
               "pickleflight");
  CLI::App& run = *app.add_subcommand("run", "run a scene, in a window or headless (the default command)");
  CLI::App& bench = *app.add_subcommand("bench", "time the steps of a scene, without drawing");
  CLI::App& scenes = *app.add_subcommand("scenes", "list the scenes");
  CLI::App& lab = *app.add_subcommand("lab", "measure accuracy, cost and limits of the methods");
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text(), "version and backends");
  for (CLI::App* command : {&run, &bench, &scenes, &lab}) {
    command->allow_extras();  // refused later, with the nearest name
    command->set_version_flag("--version", version_text(), "version and backends");
  }
  add_setting_flags(run, typed, options, kDefaultScene);
  add_run_flags(run, typed, options);
  add_data_flags(run, typed);
  add_setting_flags(bench, typed, options, kBenchScene);
  add_bench_flags(bench, typed, options);
  add_lab_flags(lab, typed, options);

  std::vector<std::string> arguments = with_split_values(arguments_of(argc, argv));
  std::reverse(arguments.begin(), arguments.end());  // the order that CLI11 expects
  try {
    app.parse(arguments);
  } catch (const CLI::CallForHelp&) {
    const bool is_general = app.get_subcommands().empty();
    return {std::nullopt, is_general ? app.help() + "\n" + run.help("pickleflight") : app.help(), 0};
  } catch (const CLI::CallForVersion&) {
    return {std::nullopt, version_text() + "\n", 0};
  } catch (const CLI::ArgumentMismatch& error) {
    throw UserError(mismatch_text(*app.get_subcommands().front(), error.what()));
  } catch (const CLI::ParseError& error) {
    throw UserError(fmt::format("{}; see pickleflight --help", one_line(error.what())));
  }
  return {checked_options(*app.get_subcommands().front(), typed, options), "", 0};
}

}  // namespace pf
