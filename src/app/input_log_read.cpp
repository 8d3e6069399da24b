// Logs of runs, read and checked.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>

#include "app/input_log.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "model/methods.hpp"
#include "scene/toml_document.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxFrames = 1e12;

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
  std::int64_t whole_number(const toml::node& node, const char* key, double max) const;
  std::optional<std::uint32_t> steps(const toml::table& table, const char* key) const;
  SecondInFrame second(const toml::table& table) const;
  void read_launch(const toml::table& table, LoggedFrame& frame) const;
  LoggedFrame frame(const toml::table& table) const;
  toml::table parse() const;

  std::string file_;
};

toml::table Reader::parse() const {
  std::error_code error;
  if (!fs::exists(file_, error))
    throw UserError(
        fmt::format("{}: there is no such file; give a log that --log or --record has written", file_));
  const std::uintmax_t bytes = fs::is_regular_file(file_, error) ? fs::file_size(file_, error) : 0;
  if (error || bytes == 0 || bytes > kMaxLogBytes) {
    throw UserError(
        fmt::format("{}: cannot be read as a log; give a file of 1 byte to 64 MiB that --log or "
                    "--record has written",
                    file_));
  }
  return parse_document(file_, "log", kMaxLogBytes);
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
  if (!value || !node.is_number() || !std::isfinite(*value))
    refuse(node, fmt::format("{} takes finite numbers", key));
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
    const auto found =
        std::find(comparison_names().begin(), comparison_names().end(), text(table, "compare"));
    if (found == comparison_names().end())
      refuse(*compare, fmt::format("compare takes one of {}", fmt::join(comparison_names(), ", ")));
    frame.compare = static_cast<Comparison>(found - comparison_names().begin());
  }
  if (const toml::node* method = table.get("method")) {
    const std::string name = text(table, "method");
    const auto found = std::find_if(kMethods.begin(), kMethods.end(),
                                    [&](const MethodRow& row) { return row.name == name; });
    if (found == kMethods.end())
      refuse(*method, fmt::format("method takes one of {}", fmt::join(method_names(), ", ")));
    frame.method = found->method;
  }
  if (const toml::node* factor = table.get("time_scale_factor")) {
    frame.time_scale_factor = number(*factor, "time_scale_factor");
    if (frame.time_scale_factor <= 0.0) refuse(*factor, "time_scale_factor takes a number above 0");
  }
  if (const toml::node* seek = table.get("seek")) frame.seek_s = number(*seek, "seek");
}

std::int64_t Reader::whole_number(const toml::node& node, const char* key, double max) const {
  const double value = number(node, key);
  if (value < 0.0 || value > max || value != std::floor(value))
    refuse(node, fmt::format("{} takes a whole number from 0 to {:.0f}", key, max));
  return static_cast<std::int64_t>(value);
}

std::optional<std::uint32_t> Reader::steps(const toml::table& table, const char* key) const {
  const toml::node* steps = table.get(key);
  if (steps == nullptr) return std::nullopt;
  return static_cast<std::uint32_t>(whole_number(*steps, key, UINT32_MAX));
}

SecondInFrame Reader::second(const toml::table& table) const {
  SecondInFrame second;
  if (const toml::node* split = table.get("split")) {
    second.split = texts(table, "split");
    check_split(*second.split, fmt::format("{}:{}", file_, split->source().begin.line));
  }
  second.max_steps = steps(table, "second_max_steps");
  second.hash = text(table, "second_hash");
  return second;
}

LoggedFrame Reader::frame(const toml::table& table) const {
  LoggedFrame frame;
  const toml::node* place = table.get("number");
  if (place == nullptr) refuse(table, "[[frame]] takes a number, a whole number from 0, as number = 60");
  frame.number = whole_number(*place, "number", kMaxFrames);
  if (table.contains("settings")) frame.restart = settings(table);
  frame.edits = texts(table, "set");
  frame.presses = texts(table, "press");
  frame.hash = text(table, "hash");
  read_launch(table, frame);
  frame.max_steps = steps(table, "max_steps");
  frame.second = second(table);
  // Edits are tried here, so that an invalid log is refused before the run.
  Settings scratch;
  apply_edits(frame.edits, scratch, fmt::format("{}:{}", file_, table.source().begin.line));
  std::vector<std::string> known;
  for (const CommandSwitch& one : command_switches()) known.emplace_back(one.name);
  for (const std::string& name : frame.presses) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      refuse(table, fmt::format("{} is not a press{}; one of {}", in_quotes(name),
                                say_nearest("; the nearest is ", name, known), fmt::join(known, ", ")));
    }
  }
  return frame;
}

RunLog Reader::read() const {
  const toml::table document = parse();
  if (document.contains("settings") && !document.contains("frame")) {
    throw UserError(
        fmt::format("{}: its run ended before the log had an entry; there is nothing to repeat", file_));
  }
  if (!document.contains("settings") || !document.contains("frame") || !document.get("frame")->is_array()) {
    throw UserError(
        fmt::format("{}: is not a log of a run, which has settings and frames; run a scene with "
                    "--scene {}",
                    file_, file_));
  }
  RunLog log{text(document, "version"),
             text(document, "backend"),
             settings(document),
             text(document, "from"),
             {},
             text(document, "from_hash"),
             {}};
  if (const toml::node* frame_number = document.get("from_frame"))
    log.from_frame = whole_number(*frame_number, "from_frame", kMaxFrames);
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

RunLog read_log(const fs::path& file) { return Reader(file).read(); }

}  // namespace pf
