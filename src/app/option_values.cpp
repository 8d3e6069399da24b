#include "app/option_values.hpp"

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
#include "app/option_flags.hpp"
#include "app/options.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"
#include "scene/settings.hpp"

namespace pf {

namespace fs = std::filesystem;

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

std::optional<double> number_in(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

double read_ui_scale(const std::string& text) {
  const std::optional<double> value = number_in(text);
  if (value && *value >= kMinUiScale && *value <= kMaxUiScale) return *value;
  throw UserError(fmt::format("--ui-scale: {} cannot be used; give a number from {} to {}", in_quotes(text),
                              kMinUiScale, kMaxUiScale));
}

std::string name_of(const char* flag, const std::string& text, const std::vector<std::string>& names) {
  check_name(flag, text, names);
  return text;
}

void check_name(const char* flag, const std::string& name, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  throw UserError(fmt::format("{}: {} is unknown{}; one of {}", flag, in_quotes(name),
                              say_nearest(", the nearest is ", name, known), fmt::join(known, ", ")));
}

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

fs::path output_file(const CLI::App& app, const std::string& flag, const std::string& text,
                     const std::vector<std::string>& endings) {
  if (app.get_option_no_throw(flag) == nullptr || app.count(flag) == 0) return {};
  fs::path file = text;
  if (text == "-" && endings.empty() && flag != "--checkpoint")
    throw UserError(fmt::format("{}: - is no file; for standard output give /dev/stdout", flag));
  const std::string ending = ending_of(file);
  if (!endings.empty() && std::find(endings.begin(), endings.end(), ending) == endings.end()) {
    throw UserError(fmt::format("{}: {} has the wrong ending; the file must end in {}", flag, in_quotes(text),
                                fmt::join(endings, " or ")));
  }
  check_writable(flag, file);
  return file;
}

fs::path table_file(const CLI::App& app, const std::string& flag, const std::string& text,
                    const std::string& ending) {
  fs::path file = output_file(app, flag, text, {});
  std::error_code ignored;
  const bool is_link = fs::is_symlink(file, ignored);  // its name says nothing of the file
  if (is_written_aside(file) && !is_link && holds_something(file) && ending_of(file) != ending)
    throw UserError(
        fmt::format("{}: {} exists, and only files that end in {} are replaced; choose another name", flag,
                    in_quotes(text), ending));
  return file;
}

fs::path record_file(const CLI::App& app, const std::string& text) {
  fs::path file = text;
  if (!is_frame_pattern(file)) {
    if (ending_of(file) == ".png") {
      throw UserError(fmt::format(
          "--record: {} has no placeholder for the frame's number; give FOLDER/%05d.png, or a film that "
          "ends in .mp4 or .mkv, or raw frames, .rgb",
          in_quotes(text)));
    }
    file = output_file(app, "--record", text, {".mp4", ".mkv", ".rgb"});
  } else {
    std::error_code ignored;
    const bool folder_is_new = file.has_parent_path() && !fs::exists(file.parent_path(), ignored);
    check_writable("--record", folder_is_new ? file.parent_path() : file);
  }
  if (!file.empty()) check_writable("--record (the film's log)", log_beside(file));
  return file;
}

[[noreturn]] void refuse_extra(const CLI::App& command, const std::string& argument) {
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    for (const std::string& name : option->get_snames()) known.push_back("-" + name);
  }
  const bool is_option = argument.starts_with('-');
  const std::string help = fmt::format("see pickleflight {} --help", command.get_name());
  if (is_option) {
    const std::string name = argument.substr(0, argument.find('='));
    throw UserError(fmt::format("{} is not an option of 'pickleflight {}'{}; {}", in_quotes(argument),
                                command.get_name(), say_nearest("; the nearest is ", name, known), help));
  }
  if (std::find(kCommands.begin(), kCommands.end(), argument) != kCommands.end()) {
    throw UserError(
        fmt::format("{} must come first: pickleflight {} [options]", in_quotes(argument), argument));
  }
  const std::vector<SceneEntry> scenes = list_scenes();
  if (std::any_of(scenes.begin(), scenes.end(), [&](const SceneEntry& s) { return s.name == argument; }))
    throw UserError(fmt::format("{} is a scene; start it with --scene {}", in_quotes(argument), argument));
  std::error_code ignored;
  if (const fs::path log = log_beside(argument); fs::is_regular_file(log, ignored)) {
    throw UserError(fmt::format("{} is a film; its flight flies again with: pickleflight run {}",
                                in_quotes(argument), log.string()));
  }
  throw UserError(fmt::format(
      "{} is neither a command nor the value of an option{} (commands: {}); {}", in_quotes(argument),
      say_nearest("; the nearest command is ", argument, kCommands), fmt::join(kCommands, ", "), help));
}

}  // namespace pf
