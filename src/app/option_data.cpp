#include "app/option_data.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>

#include "app/option_values.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

constexpr double kMaxInterval_s = 1e6;

double read_interval(const char* flag, const std::string& text) {
  const std::optional<double> value = number_in(text);
  if (value && *value > 0.0 && *value <= kMaxInterval_s) return *value;
  throw UserError(fmt::format("{}: {} is not a time; give seconds of simulated time, above 0 and up to 1e6",
                              flag, in_quotes(text)));
}

std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> parts = CLI::detail::split(text, ',');
  for (std::string& part : parts) part = CLI::detail::trim_copy(part);
  return parts;
}

std::vector<std::string> read_fields(const std::string& text) {
  std::vector<std::string> fields;
  for (const std::string& name : split_at_commas(text))
    fields.push_back(name_of("--dump-fields", name, kDumpFields));
  const auto has = [&](const char* name) {
    return std::find(fields.begin(), fields.end(), name) != fields.end();
  };
  if (!has("position"))
    throw UserError("--dump-fields: position is missing; a trajectory has it, as in position,velocity");
  // A state that a run goes on from has velocities.
  if (has("state") && !has("velocity")) fields.emplace_back("velocity");
  return fields;
}

void read_dump(const CLI::App& command, const Typed& typed, DataOptions& data) {
  for (const auto& [flag, is_given] : {std::pair("--dump-every", typed.dump_every.has_value()),
                                       std::pair("--dump-fields", typed.dump_fields.has_value()),
                                       std::pair("--dump-compression", typed.dump_compression.has_value())}) {
    if (is_given && typed.dump.empty())
      throw UserError(
          fmt::format("{}: needs --dump {}; add it", flag,
                      std::string_view(flag) == "--dump-every" ? "FILE.h5 or FILE.xyz" : "FILE.h5"));
  }
  data.dump = output_file(command, "--dump", typed.dump, {".h5", ".xyz"});
  const bool is_text = ending_of(data.dump) == ".xyz";
  if (!data.dump.empty() && !is_text && !PF_HAVE_HDF5) {
    throw UserError(
        "--dump: this build has no HDF5; install the package libhdf5-dev, configure and build again, or give "
        "FILE.xyz");
  }
  if (is_text && (typed.dump_fields || typed.dump_compression))
    throw UserError(
        "--dump: a .xyz has position and velocity as text; leave out --dump-fields and --dump-compression, "
        "or give FILE.h5");
  if (typed.dump_every) data.dump_every_s = read_interval("--dump-every", *typed.dump_every);
  data.dump_fields = typed.dump_fields ? read_fields(*typed.dump_fields) : kDumpFields;
  if (typed.dump_compression)
    data.dump_compression = whole_number("--dump-compression", *typed.dump_compression, 0, 9);
}

void read_checkpoint(const CLI::App& command, const Typed& typed, DataOptions& data) {
  data.checkpoint = output_file(command, "--checkpoint", typed.checkpoint, {});
  if (!data.checkpoint.empty() && command.count("--still") > 0)
    throw UserError(
        "--checkpoint: the last frame before a --still may be shorter than others, and no flight goes on "
        "from there as it would have; leave out one of them");
  std::error_code ignored;
  if (std::filesystem::exists(data.checkpoint, ignored) &&
      !std::filesystem::is_regular_file(data.checkpoint, ignored)) {
    throw UserError(
        fmt::format("--checkpoint: {} is not a regular file, which a checkpoint replaces; choose another",
                    in_quotes(data.checkpoint.string())));
  }
  if (!typed.checkpoint_every) return;
  if (data.checkpoint.empty()) throw UserError("--checkpoint-every: needs --checkpoint FILE; add it");
  data.checkpoint_every_s = read_interval("--checkpoint-every", *typed.checkpoint_every);
}

// Settings that say how long and on how much of the machine a run goes on; they change no state.
constexpr std::array<std::string_view, 3> kBesideFrom = {"run.seconds", "run.threads", "run.frame_budget_ms"};

// Notes "section.key = value" for a setting of the command line.
void note_edit(const std::string& given, const std::string& path, const Settings& settings,
               DataOptions& data) {
  if (std::find(kBesideFrom.begin(), kBesideFrom.end(), path) == kBesideFrom.end()) {
    throw UserError(fmt::format("--from: the file has its own scene and settings; leave out {}; it allows {}",
                                given, fmt::join(kBesideFrom, ", ")));
  }
  data.from_edits.push_back(edit_text(find_field(path, "--from"), settings));
}

void read_from(const Typed& typed, Options& options) {
  DataOptions& data = options.data;
  if (typed.from_frame && !typed.from) throw UserError("--from-frame: needs --from FILE.h5; add it");
  if (!typed.from) return;
  data.from = *typed.from;
  if (typed.from_frame) data.from_frame = whole_number("--from-frame", *typed.from_frame, 0, 2000000000);
  for (const auto& [flag, is_given] :
       {std::pair("--scene", typed.scene.has_value()), std::pair("--cues", typed.cues.has_value()),
        std::pair("--accuracy", typed.accuracy.has_value()),
        std::pair("the log to replay", typed.replay.has_value()),
        std::pair("--save-scene", !typed.save_scene.empty()), std::pair("--force", typed.force)}) {
    if (is_given)
      throw UserError(fmt::format("--from: the file has its own scene and settings; leave out {}", flag));
  }
  for (const std::string& set : typed.sets)
    note_edit("--set " + set, CLI::detail::trim_copy(set.substr(0, set.find('='))), options.settings, data);
  for (const auto& [flag, text] : typed.flags) note_edit(flag->flag, flag->path, options.settings, data);
}

}  // namespace

void add_data_flags(CLI::App& app, Typed& typed) {
  app.add_option(
         "--dump", typed.dump,
         "write positions and velocities of parcels and ball: H5MD (.h5, with FILE.xdmf for ParaView) or "
         "extended XYZ (.xyz, for OVITO)")
      ->type_name("FILE");
  add_text(app, "--dump-every", typed.dump_every, "T",
           "seconds of simulated time between dumped frames; default: every frame");
  add_text(app, "--dump-fields", typed.dump_fields, "LIST",
           "what a .h5 has of the parcels; position, velocity, state (what --from needs, with velocity); "
           "default all three");
  add_text(app, "--dump-compression", typed.dump_compression, "LEVEL", "of a .h5; 0 (off) to 9; default 0");
  app.add_option("--checkpoint", typed.checkpoint,
                 "write a file at the end of the run from which --from goes on to the same bits")
      ->type_name("FILE");
  add_text(app, "--checkpoint-every", typed.checkpoint_every, "T",
           "write it every T seconds of simulated time, too; the file is always a whole one");
  add_text(app, "--from", typed.from, "FILE", "go on from a checkpoint, or from a frame of a dump (.h5)");
  add_text(app, "--from-frame", typed.from_frame, "N", "frame of the dump, from 0; default the last one");
}

void read_data_options(const CLI::App& command, const Typed& typed, Options& options) {
  read_dump(command, typed, options.data);
  read_checkpoint(command, typed, options.data);
  read_from(typed, options);
}

}  // namespace pf
