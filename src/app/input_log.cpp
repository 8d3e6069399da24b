#include "app/input_log.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "app/flight_pair.hpp"
#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "model/methods.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFirstLine = "# Inputs of a flight. Replay it with: pickleflight run THIS_FILE";

std::string array_text(const char* key, const std::vector<std::string>& values, const char* between) {
  std::vector<std::string> texts;
  for (const std::string& value : values) texts.push_back(toml_string(value));
  const bool is_one_line = std::string_view(between) == ", ";
  return fmt::format("{} = [{}{}]\n", key, is_one_line ? "" : "\n  ", fmt::join(texts, between));
}

std::string settings_text(const Settings& settings) {
  std::vector<std::string> all;
  for (const Field& field : fields()) all.push_back(edit_text(field, settings));
  return fmt::format("scene = {}\n", toml_string(settings.name)) + array_text("settings", all, ",\n  ");
}

// Edits that the user asked for and that took effect. A refused edit has none. The number of parcels counts
// even if not asked for, since it may have been resolved for the backend.
std::vector<std::string> edits_between(const Settings& before, const Settings& asked, const Settings& after) {
  std::vector<std::string> edits;
  for (const Field& field : fields()) {
    const auto differs = [&](const Settings& s) { return value_text(field, s) != value_text(field, before); };
    const bool is_asked = differs(asked) || field.path() == "air.num_parcels";
    if (is_asked && differs(after)) edits.push_back(edit_text(field, after));
  }
  return edits;
}

std::string frame_text(const LoggedFrame& frame) {
  std::string text = fmt::format("\n[[frame]]\nnumber = {}\n", frame.number);
  if (frame.restart) text += settings_text(*frame.restart);
  if (!frame.edits.empty()) text += array_text("set", frame.edits, ", ");
  if (!frame.presses.empty()) text += array_text("press", frame.presses, ", ");
  if (frame.fly) {
    text += fmt::format("fly = [{}, {}, {}]\n", frame.fly->velocity_mps.x, frame.fly->velocity_mps.y,
                        frame.fly->spin_radps);
  }
  if (frame.compare != Comparison::none)
    text += fmt::format("compare = {}\n", toml_string(comparison_names()[static_cast<int>(frame.compare)]));
  if (frame.method) text += fmt::format("method = {}\n", toml_string(method_name(*frame.method)));
  if (frame.time_scale_factor != 1.0)
    text += fmt::format("time_scale_factor = {}\n", frame.time_scale_factor);
  if (frame.seek_s) text += fmt::format("seek = {}\n", *frame.seek_s);
  if (frame.max_steps) text += fmt::format("max_steps = {}\n", *frame.max_steps);
  if (!frame.hash.empty()) text += fmt::format("hash = {}\n", toml_string(frame.hash));
  return text + second_text(frame.second);
}

}  // namespace

std::string hash_of(Simulation& simulation) {
  return fmt::format("{:016x}", simulation.backend().state_hash());
}

const std::vector<std::string>& comparison_names() {
  static const std::vector<std::string> names = {"none", "next_method", "half_step", "scene_step"};
  return names;
}

namespace {

std::string from_text(const fs::path& from, std::optional<std::int64_t> frame, Simulation& simulation) {
  if (from.empty()) return "";
  const std::string number = frame ? fmt::format("from_frame = {}\n", *frame) : "";
  return fmt::format("from = {}\n{}from_hash = {}\n", toml_string(fs::absolute(from).string()), number,
                     toml_string(hash_of(simulation)));
}

}  // namespace

bool may_become_log(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored) || fs::file_size(file, ignored) == 0) return true;
  std::string first;
  std::getline(std::ifstream(file), first);
  return first == kFirstLine;
}

InputLog::InputLog(Simulation& simulation, const std::string& backend, const fs::path& from,
                   std::optional<std::int64_t> from_frame)
    : text_(fmt::format("{}\nversion = {}\nbackend = {}\n", kFirstLine, toml_string(PF_VERSION),
                        toml_string(backend)) +
            from_text(from, from_frame, simulation) + settings_text(simulation.settings())) {}

void InputLog::begin_frame(const Commands& commands, Simulation& simulation) {
  const bool seeks = commands.seek_s || commands.back;
  if (is_open_ && simulation.view().unfinished && !seeks) return;
  if (is_open_) end_early(simulation);
  is_open_ = false;
  if (!commands.split) note_second();
  frame_ = {};
  frame_.second.split = commands.split;
  frame_.number = num_frames_;
  for (const CommandSwitch& one : command_switches()) {
    if (commands.*one.member) frame_.presses.emplace_back(one.name);
  }
  frame_.seek_s = commands.seek_s;
  is_seek_ = seeks;
  frame_.fly = commands.fly;
  frame_.compare = commands.compare;
  frame_.time_scale_factor = commands.time_scale_factor;
  settings_before_ = simulation.settings();
  asked_ = commands.settings;
  num_scenes_before_ = simulation.view().num_scenes;
  num_fallbacks_before_ = simulation.num_fallbacks();
}

// A jump in time that another one follows before it is complete has no steps of its own. A replay completes
// it.
void InputLog::end_early(Simulation& simulation) {
  if (is_seek_) {
    ++num_frames_;
    return note(frame_);
  }
  frame_.max_steps = simulation.view().num_done;
  complete_frame(simulation);
}

void InputLog::end_frame(Simulation& simulation) {
  note_inputs(simulation);
  is_seek_ = is_seek_ && simulation.view().sought_s.has_value();  // not refused
  is_open_ = simulation.view().unfinished;
  if (!is_open_) complete_frame(simulation);
}

void InputLog::note_inputs(const Simulation& simulation) {
  const bool is_new = simulation.view().num_scenes != num_scenes_before_ ||
                      simulation.num_fallbacks() != num_fallbacks_before_;
  const Settings* edited = simulation.view().edited;
  if (is_new) {
    frame_.restart = simulation.settings();
    frame_.edits.clear();
  } else if (asked_ && edited) {
    frame_.edits = edits_between(settings_before_, *asked_, *edited);
  }
  if (frame_.compare == Comparison::next_method && !frame_.method)
    frame_.method = simulation.settings().method;
  asked_.reset();  // the first picture of the frame makes its edits
}

void InputLog::complete_frame(Simulation& simulation) {
  ++num_frames_;
  is_hash_due_ = !files_.empty() && (is_hash_due_ || num_frames_ % kFramesPerHash == 0);
  if (is_hash_due_ && !simulation.view().mid_step) {
    frame_.hash = hash_of(simulation);
    is_hash_due_ = false;
  }
  is_second_hash_due_ = is_second_hash_due_ || !frame_.hash.empty();
  const bool has_launch = frame_.fly || frame_.second.split || frame_.compare != Comparison::none ||
                          frame_.time_scale_factor != 1.0;
  const bool has_input = frame_.restart || has_launch || frame_.seek_s || frame_.max_steps ||
                         !frame_.edits.empty() || !frame_.presses.empty();
  if (has_input || !frame_.hash.empty()) note(frame_);
}

// The second flight's end of the last frame, which may be later than the first one's.
void InputLog::note_second() {
  LoggedFrame last;
  last.number = num_frames_ - 1;
  if (pair_ != nullptr) last.second.max_steps = pair_->second_cut();
  if (is_second_hash_due_) last.second.hash = second_hash();
  is_second_hash_due_ = false;
  if (last.second.max_steps || !last.second.hash.empty()) note(last);
}

// Empty unless there is a second flight and its frame is done.
std::string InputLog::second_hash() const {
  Simulation* second = pair_ != nullptr ? pair_->second() : nullptr;
  return second != nullptr && pair_->is_whole() ? hash_of(*second) : "";
}

void InputLog::note(const LoggedFrame& frame) {
  const std::string text = frame_text(frame);
  text_ += text;
  if (!frame.hash.empty()) last_hashed_ = frame.number;
  for (File& file : files_) write(file, text);
}

// An entry that could not be written whole is taken back, since a file that ends within a line does not
// replay.
void InputLog::write(File& file, const std::string& text) {
  if (!file.stream) return;
  file.stream << text << std::flush;
  if (file.stream) {
    file.num_bytes += text.size();
    return;
  }
  file.stream.close();  // which tries once more to write the rest
  std::error_code not_a_file;
  fs::resize_file(file.path, file.num_bytes, not_a_file);
  failed_ = true;
  if (!failure_.empty()) return;
  failure_ = fmt::format(
      "{}: the log broke off: it could not be written (is the disk full?); it is whole up to there",
      in_quotes(file.path.string()));
}

void InputLog::open(const fs::path& file) {
  errno = 0;
  File opened{file, std::ofstream(file, std::ios::binary | std::ios::trunc), text_.size()};
  opened.stream << text_ << std::flush;
  if (!opened.stream) {
    const int error = errno;
    remove_if_empty(file);
    throw UserError(fmt::format("{}: the log cannot be written: {}; choose another folder",
                                in_quotes(file.string()), std::strerror(error)));
  }
  files_.push_back(std::move(opened));
}

void InputLog::close(const fs::path& path, Simulation& simulation) {
  const auto found =
      std::find_if(files_.begin(), files_.end(), [&](const File& file) { return file.path == path; });
  if (found == files_.end()) return;
  const std::optional<std::uint32_t> second_cut = pair_ != nullptr ? pair_->second_cut() : std::nullopt;
  if (is_open_ || is_second_hash_due_ || second_cut || num_frames_ - 1 > last_hashed_) {
    LoggedFrame last;
    if (is_open_) last = frame_;
    last.number = is_open_ ? num_frames_ : num_frames_ - 1;
    const bool is_seeking = is_open_ && is_seek_;
    if (is_open_ && !is_seeking) last.max_steps = simulation.view().num_done;
    try {
      if (!simulation.view().mid_step && !is_seeking) last.hash = hash_of(simulation);
      if (!is_open_) last.second.hash = second_hash();
    } catch (const DeviceError&) {  // the log ends without a hash, and what follows it comes to its end
    }
    if (!is_open_) last.second.max_steps = second_cut;
    write(*found, frame_text(last));
  }
  files_.erase(found);
}

void InputLog::close_all(Simulation& simulation) {
  while (!files_.empty()) close(fs::path(files_.front().path), simulation);
}

std::string InputLog::take_failure() { return std::exchange(failure_, ""); }

}  // namespace pf
