#include "app/output_clash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "app/encoder.hpp"
#include "app/frame_names.hpp"
#include "app/input_log.hpp"
#include "app/option_values.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/link_target.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

struct NamedFile {
  std::string flag;
  fs::path file;
};

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  if (fs::exists(a, ignored) && fs::exists(b, ignored))
    return fs::is_regular_file(a, ignored) && fs::equivalent(a, b, ignored);
  return fs::weakly_canonical(fs::absolute(a), ignored) == fs::weakly_canonical(fs::absolute(b), ignored);
}

// other: possibly the pattern of a film's frames.
bool is_same_file_or_frame(const fs::path& file, const fs::path& other) {
  if (!is_frame_pattern(other)) return is_same_file(file, other);
  const std::optional<int> frame = frame_of(other, file);
  return frame && is_same_file(file, frame_file(other, *frame));
}

// A scene or a list of cues that has a name of its own is no file of the user's.
fs::path file_of(const std::optional<std::string>& text) {
  return text && ending_of(*text) == ".toml" ? *text : "";
}

std::vector<NamedFile> inputs_of(const Typed& typed, const Options& options) {
  return {{"--scene", file_of(typed.scene)},
          {"--cues", file_of(typed.cues)},
          {"the log to replay", typed.replay.value_or("")},
          {"--from", options.data.from}};
}

// An output that was asked for.
struct Output {
  NamedFile named;
  bool is_whole = true;  // written at the end, under a temporary name, and renamed
};

// The film is the first one, so that the others are compared with its frames.
std::vector<Output> outputs_of(const Options& options) {
  std::vector<Output> outputs = {
      {{"--record", options.record == kNullDevice ? fs::path() : options.record}, false},
      {{"--report", options.report}},
      {{"--log", options.log}, false},
      {{"--overlay-csv", options.overlay_csv}, false},
      {{"--profile-csv", options.profile_csv}, false},
      {{"--checkpoint", options.data.checkpoint}},
      {{"--dump", options.data.dump}, false},
      {{"--picture", options.picture}},
      {{"--still", options.still}},
      {{"--save-scene", options.save_scene}},
      {{"--panel-map", options.panel_map}},
      {{"--json", options.bench_json}}};
  std::erase_if(outputs, [](const Output& output) { return output.named.file.empty(); });
  return outputs;
}

bool has_part(const Output& output) { return output.is_whole && is_written_aside(output.named.file); }

// Adds the other files of a dump: its index for ParaView, its temporary file, and with cues one dump for each
// world, at most as many as there are cues.
void add_files_of_dump(const Options& options, std::vector<NamedFile>& files) {
  const fs::path& dump = options.data.dump;
  if (ending_of(dump) != ".h5") return;
  const int num = options.cues ? static_cast<int>(options.cues->cues.size()) : 1;
  for (int i = 1; i <= num; ++i) {
    const fs::path file = numbered(dump, i);
    if (i > 1) files.push_back({fmt::format("--dump (number {})", i), file});
    const fs::path index = fs::path(file).replace_extension(".xdmf");
    files.push_back({"--dump (its index)", index});
    files.push_back({"--dump (the first part of its index)", part_of(index)});
    files.push_back({"--dump (its first part)", part_of(file)});
  }
}

// Logs that a run or a bench writes.
std::vector<NamedFile> logs_of(const Options& options) {
  std::vector<NamedFile> logs = {{"--log", options.log}};
  if (options.record.empty() || options.record == kNullDevice) return logs;
  logs.push_back({"--record (the film's log)", log_beside(options.record)});
  const bool may_be_frames = !is_frame_pattern(options.record) && ending_of(options.record) != ".rgb";
  if (may_be_frames && !ffmpeg_available())
    logs.push_back({"--record (the log of its frames)", log_beside(frames_instead_of(options.record))});
  return logs;
}

// A scene or a list of cues may have the name of a log, which nobody typed.
void check_logs(const Options& options) {
  for (const auto& [flag, file] : logs_of(options)) {
    if (!file.empty() && !may_become_log(file))
      throw UserError(fmt::format("{}: {} is there and is no log; choose another name, or move that file",
                                  flag, in_quotes(file.string())));
  }
}

// All files that a run may write.
std::vector<NamedFile> written_files(const Options& options) {
  const std::vector<Output> outputs = outputs_of(options);
  std::vector<NamedFile> files;
  for (const Output& output : outputs) files.push_back(output.named);
  add_files_of_dump(options, files);
  for (const Output& output : outputs) {
    const auto& [flag, file] = output.named;
    if (has_part(output)) files.push_back({flag + " (while it is written)", part_of(file)});
  }
  if (!options.panel_map.empty())
    files.push_back({"--panel-map (the number of frames)", frames_beside(options.panel_map)});
  for (const NamedFile& log : logs_of(options))
    if (log.file != options.log) files.push_back(log);
  return files;
}

}  // namespace

void check_outputs(const Typed& typed, const Options& options) {
  std::vector<NamedFile> others = inputs_of(typed, options);
  for (const NamedFile& output : written_files(options)) {
    if (output.file.empty()) continue;
    for (const NamedFile& other : others) {
      const bool goes_on = output.flag == "--checkpoint" && other.flag == "--from" &&
                           ending_of(output.file) != ".h5" && ending_of(output.file) != ".xyz";
      if (other.file.empty() || goes_on || !is_same_file_or_frame(output.file, other.file)) continue;
      throw UserError(fmt::format("{}: {} is the file of {} as well; choose another name", output.flag,
                                  in_quotes(output.file.string()), other.flag));
    }
    others.push_back(output);
  }
  check_logs(options);
  for (const Output& output : outputs_of(options)) {
    const auto& [flag, file] = output.named;
    if (has_part(output)) check_writable(flag, part_of(link_target(file)));
  }
}

}  // namespace pf
