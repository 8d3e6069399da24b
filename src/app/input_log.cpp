#include "app/input_log.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

// In the order of Comparison.
const std::vector<std::string> kComparisonNames = {"none", "next_method", "half_step", "scene_step"};

constexpr std::uintmax_t kMaxLogBytes = 64U << 20;  // a year of hashes

std::string array_text(const char* key, const std::vector<std::string>& values, const char* between) {
  std::vector<std::string> texts;
  for (const std::string& value : values) texts.push_back(toml_string(value));
  const bool is_one_line = std::string_view(between) == ", ";
  return fmt::format("{} = [{}{}]\n", key, is_one_line ? "" : "\n  ", fmt::join(texts, between));
}

std::string edit_text(const Field& field, const Settings& settings) {
  return field.path() + " = " + value_text(field, settings);
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
    text += fmt::format("compare = {}\n", toml_string(kComparisonNames[static_cast<int>(frame.compare)]));
  if (frame.time_scale_factor != 1.0)
    text += fmt::format("time_scale_factor = {}\n", frame.time_scale_factor);
  if (frame.max_steps) text += fmt::format("max_steps = {}\n", *frame.max_steps);
  if (!frame.hash.empty()) text += fmt::format("hash = {}\n", toml_string(frame.hash));
  return text;
}

std::string hash_of(Simulation& simulation) {
  return fmt::format("{:016x}", simulation.backend().state_hash());
}

class Reader {
 public:
  explicit Reader(const fs::path& file) : file_(file.string()) {}

  RunLog read() const;

 private:
  [[noreturn]] void refuse(const toml::node& node, const std::string& reason) const {
    throw UserError(fmt::format("{}:{}: {}", file_, node.source().begin.line, reason));
  }
  std::string text(const toml::table& table, const char* key) const;
  std::vector<std::string> texts(const toml::table& table, const char* key) const;
  Settings settings(const toml::table& table) const;
  double number(const toml::node& node, const char* key) const;
  void read_launch(const toml::table& table, LoggedFrame& frame) const;
  LoggedFrame frame(const toml::table& table) const;
  toml::table parse() const;

  std::string file_;
};

toml::table Reader::parse() const {
  std::error_code error;
  const std::uintmax_t bytes = fs::is_regular_file(file_, error) ? fs::file_size(file_, error) : 0;
  if (error || bytes == 0 || bytes > kMaxLogBytes) {
    throw UserError(
        fmt::format("{}: cannot be read as a log; give a file of 1 byte to 64 MiB that --log or "
                    "--record has written",
                    file_));
  }
  try {
    return toml::parse_file(file_);
  } catch (const toml::parse_error& parse_error) {
    std::string reason(parse_error.description());
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw UserError(fmt::format("{}:{}: not valid TOML: {}", file_, parse_error.source().begin.line, reason));
  }
}

std::string Reader::text(const toml::table& table, const char* key) const {
  const toml::node* node = table.get(key);
  if (node == nullptr) return "";
  const auto value = node->value<std::string>();
  if (!node->is_string()) refuse(*node, fmt::format("{} takes a text in quotes", key));
  return *value;
}

std::vector<std::string> Reader::texts(const toml::table& table, const char* key) const {
  std::vector<std::string> all;
  const toml::node* node = table.get(key);
  if (node == nullptr) return all;
  if (!node->is_array()) refuse(*node, fmt::format("{} takes a list of texts in quotes", key));
  for (const toml::node& element : *node->as_array()) {
    if (!element.is_string()) refuse(element, fmt::format("{} takes texts in quotes", key));
    all.push_back(*element.value<std::string>());
  }
  return all;
}

Settings Reader::settings(const toml::table& table) const {
  Settings settings;
  settings.name = text(table, "scene");
  apply_edits(texts(table, "settings"), settings,
              fmt::format("{}:{}", file_, table.get("settings")->source().begin.line));
  return settings;
}

double Reader::number(const toml::node& node, const char* key) const {
  const auto value = node.value<double>();
  if (!node.is_number() || !std::isfinite(*value)) refuse(node, fmt::format("{} takes finite numbers", key));
  return *value;
}

void Reader::read_launch(const toml::table& table, LoggedFrame& frame) const {
  if (const toml::node* fly = table.get("fly")) {
    const toml::array* parts = fly->as_array();
    if (parts == nullptr || parts->size() != 3)
      refuse(*fly, "fly takes velocity and spin, [x in m/s, y in m/s, rad/s]");
    frame.fly = {{number(*parts->get(0), "fly"), number(*parts->get(1), "fly")},
                 number(*parts->get(2), "fly")};
  }
  if (const toml::node* compare = table.get("compare")) {
    const auto found = std::find(kComparisonNames.begin(), kComparisonNames.end(), text(table, "compare"));
    if (found == kComparisonNames.end())
      refuse(*compare, fmt::format("compare takes one of {}", fmt::join(kComparisonNames, ", ")));
    frame.compare = static_cast<Comparison>(found - kComparisonNames.begin());
  }
  if (const toml::node* factor = table.get("time_scale_factor")) {
    frame.time_scale_factor = number(*factor, "time_scale_factor");
    if (frame.time_scale_factor <= 0.0) refuse(*factor, "time_scale_factor takes a number above 0");
  }
}

LoggedFrame Reader::frame(const toml::table& table) const {
  LoggedFrame frame;
  const toml::node* place = table.get("number");
  if (place == nullptr || !place->is_integer() || *place->value<std::int64_t>() < 0)
    refuse(table, "[[frame]] takes a number, a whole number from 0, as number = 60");
  frame.number = *place->value<std::int64_t>();
  if (table.contains("settings")) frame.restart = settings(table);
  frame.edits = texts(table, "set");
  frame.presses = texts(table, "press");
  frame.hash = text(table, "hash");
  read_launch(table, frame);
  if (const toml::node* steps = table.get("max_steps")) {
    const double most = number(*steps, "max_steps");
    if (most < 0.0 || most > UINT32_MAX || most != std::floor(most))
      refuse(*steps, "max_steps takes a whole number from 0");
    frame.max_steps = static_cast<std::uint32_t>(most);
  }
  // Edits are tried here, so that an invalid log is refused before the run.
  Settings scratch;
  apply_edits(frame.edits, scratch, fmt::format("{}:{}", file_, table.source().begin.line));
  std::vector<std::string> known;
  for (const CommandSwitch& one : command_switches()) known.emplace_back(one.name);
  for (const std::string& name : frame.presses) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      refuse(table, fmt::format("{} is not a press; the nearest is {}; one of {}", in_quotes(name),
                                nearest_name(name, known), fmt::join(known, ", ")));
    }
  }
  return frame;
}

RunLog Reader::read() const {
  const toml::table document = parse();
  if (!document.contains("settings") || !document.contains("frame") || !document.get("frame")->is_array()) {
    throw UserError(
        fmt::format("{}: is not a log of a run, which has settings and frames; run a scene with "
                    "--scene {}",
                    file_, file_));
  }
  RunLog log{text(document, "version"), text(document, "backend"), settings(document), {}};
  for (const toml::node& node : *document.get("frame")->as_array()) {
    if (!node.is_table()) refuse(node, "frame takes tables, written [[frame]]");
    log.frames.push_back(frame(*node.as_table()));
    const std::size_t last = log.frames.size() - 1;
    if (last > 0 && log.frames[last].number < log.frames[last - 1].number)
      refuse(node, "its number is below that of the previous frame; sort the frames by number");
  }
  return log;
}

}  // namespace

void apply_edits(const std::vector<std::string>& edits, Settings& settings, const std::string& where) {
  for (const std::string& edit : edits) {
    const std::size_t equals = edit.find(" = ");
    if (equals == std::string::npos) {
      throw UserError(fmt::format("{}: {} is not a setting with its value; give section.key = value", where,
                                  in_quotes(edit)));
    }
    set_from_text(find_field(edit.substr(0, equals), where), settings, edit.substr(equals + 3), where);
  }
}

std::vector<CommandSwitch> command_switches() {
  return {{"toggle_pause", &Commands::toggle_pause},
          {"single_step", &Commands::single_step},
          {"reset", &Commands::reset},
          {"launch", &Commands::launch},
          {"hold", &Commands::hold},
          {"back", &Commands::back}};
}

RunLog read_log(const fs::path& file) { return Reader(file).read(); }

InputLog::InputLog(const Simulation& simulation, const std::string& backend)
    : text_(fmt::format("# Inputs of a flight. Replay it with: pickleflight run THIS_FILE\n"
                        "version = {}\nbackend = {}\n",
                        toml_string(PF_VERSION), toml_string(backend)) +
            settings_text(simulation.settings())) {}

void InputLog::begin_frame(const Commands& commands, Simulation& simulation) {
  if (is_open_ && simulation.view().unfinished) return;
  if (is_open_) {
    frame_.max_steps = simulation.view().num_done;
    complete_frame(simulation);
  }
  is_open_ = false;
  frame_ = {};
  frame_.number = num_frames_;
  for (const CommandSwitch& one : command_switches()) {
    if (commands.*one.member) frame_.presses.emplace_back(one.name);
  }
  frame_.fly = commands.fly;
  frame_.compare = commands.compare;
  frame_.time_scale_factor = commands.time_scale_factor;
  settings_before_ = simulation.settings();
  asked_ = commands.settings;
  num_scenes_before_ = simulation.view().num_scenes;
  num_fallbacks_before_ = simulation.num_fallbacks();
}

void InputLog::end_frame(Simulation& simulation) {
  note_inputs(simulation);
  is_open_ = simulation.view().unfinished;
  if (!is_open_) complete_frame(simulation);
}

void InputLog::note_inputs(const Simulation& simulation) {
  const bool is_new = simulation.view().num_scenes != num_scenes_before_ ||
                      simulation.num_fallbacks() != num_fallbacks_before_;
  frame_.edits.clear();
  if (is_new) {
    frame_.restart = simulation.settings();
  } else if (asked_) {
    frame_.edits = edits_between(settings_before_, *asked_, simulation.settings());
  }
}

void InputLog::complete_frame(Simulation& simulation) {
  ++num_frames_;
  is_hash_due_ = !files_.empty() && (is_hash_due_ || num_frames_ % kFramesPerHash == 0);
  if (is_hash_due_ && !simulation.view().mid_step) {
    frame_.hash = hash_of(simulation);
    is_hash_due_ = false;
  }
  const bool has_launch = frame_.fly || frame_.compare != Comparison::none || frame_.time_scale_factor != 1.0;
  const bool has_input =
      frame_.restart || has_launch || frame_.max_steps || !frame_.edits.empty() || !frame_.presses.empty();
  if (has_input || !frame_.hash.empty()) note(frame_);
}

void InputLog::note(const LoggedFrame& frame) {
  const std::string text = frame_text(frame);
  text_ += text;
  if (!frame.hash.empty()) last_hashed_ = frame.number;
  for (File& file : files_) write(file, text);
}

void InputLog::write(File& file, const std::string& text) {
  if (!file.stream) return;
  file.stream << text << std::flush;
  if (file.stream || !failure_.empty()) return;
  failure_ =
      fmt::format("{}: the log can no longer be written (is the disk full?); the run continues without it",
                  in_quotes(file.path.string()));
}

void InputLog::open(const fs::path& file) {
  File opened{file, std::ofstream(file, std::ios::binary | std::ios::trunc)};
  opened.stream << text_ << std::flush;
  if (!opened.stream) {
    throw UserError(
        fmt::format("{}: the log cannot be written; choose a folder that exists, is writable and "
                    "has free space",
                    in_quotes(file.string())));
  }
  files_.push_back(std::move(opened));
}

void InputLog::close(const fs::path& path, Simulation& simulation) {
  const auto found =
      std::find_if(files_.begin(), files_.end(), [&](const File& file) { return file.path == path; });
  if (found == files_.end()) return;
  if (is_open_ || num_frames_ - 1 > last_hashed_) {
    LoggedFrame last;
    if (is_open_) last = frame_;
    last.number = is_open_ ? num_frames_ : num_frames_ - 1;
    if (is_open_) last.max_steps = simulation.view().num_done;
    if (!simulation.view().mid_step) last.hash = hash_of(simulation);
    write(*found, frame_text(last));
  }
  files_.erase(found);
}

void InputLog::close_all(Simulation& simulation) {
  while (!files_.empty()) close(fs::path(files_.front().path), simulation);
}

std::string InputLog::take_failure() { return std::exchange(failure_, ""); }

}  // namespace pf
