#include "scene/toml_document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/error.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

// Reason why the file cannot be read, or "". The file is not opened: a pipe would wait, and a device may
// never end.
std::string obstacle_to_reading(const fs::path& file, const char* kind, std::uintmax_t max_bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) return "cannot be read; check that the file exists and that you may read it";
  if (fs::is_directory(status)) return fmt::format("is a folder; give a {} ending in .toml", kind);
  if (!fs::is_regular_file(status))
    return fmt::format("is not a regular file; give a {} ending in .toml", kind);
  const std::uintmax_t bytes = fs::file_size(file, error);
  if (error || bytes <= max_bytes) return "";
  return fmt::format("is larger than {} MiB, the limit for a {} (it has {} bytes)", max_bytes >> 20, kind,
                     bytes);
}

// Kind of TOML value that a field takes. Without this check a wrong kind would pass as text ("0.9" for 0.9).
const char* expected_kind(const Field& field) {
  if (std::holds_alternative<bool Settings::*>(field.member)) return "true or false";
  if (std::holds_alternative<std::string Settings::*>(field.member)) return "a text in quotes";
  if (std::holds_alternative<Choice>(field.member)) return "a name in quotes";
  return "a number without quotes";
}

std::string text_of(const toml::node& node, const Field& field, const std::string& where) {
  const std::string expected = expected_kind(field);
  if (expected == "true or false" && node.is_boolean()) return *node.value<bool>() ? "true" : "false";
  if (expected.ends_with("in quotes") && node.is_string()) return *node.value<std::string>();
  if (expected.starts_with("a number") && node.is_integer())
    return fmt::format("{}", *node.value<std::int64_t>());
  if (expected.starts_with("a number") && node.is_floating_point()) {
    // From 2^53 on the file may have had other digits; as a power, a whole number will not take it.
    const double value = *node.value<double>();
    return std::fabs(value) < kMaxExactInteger ? fmt::format("{}", value) : fmt::format("{:.16e}", value);
  }
  throw UserError(fmt::format("{}: {} has a value of the wrong type; it takes {}, as {} = {}", where,
                              field.path(), expected, field.key,
                              expected.ends_with("in quotes") ? "\"" + value_text(field, Settings{}) + "\""
                                                              : value_text(field, Settings{})));
}

}  // namespace

std::string read_document(const fs::path& file, const char* kind, std::uintmax_t max_bytes) {
  const std::string obstacle = obstacle_to_reading(file, kind, max_bytes);
  if (!obstacle.empty()) throw UserError(fmt::format("{}: {}", file.string(), obstacle));
  std::ifstream stream(file, std::ios::binary);
  std::string text(max_bytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  // The read must end at the end of the file. Any other end is an error: no permission, a failing disk.
  if (!stream.eof() || stream.bad()) {
    throw UserError(fmt::format("{}: cannot be read; check that the file exists and that you may read it",
                                file.string()));
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return text;
}

toml::table parse_text(const std::string& text, const fs::path& file) {
  if (has_deep_keys(text)) throw UserError(fmt::format("{}: a key has more than 1000 parts", file.string()));
  try {
    return toml::parse(text, file.string());
  } catch (const toml::parse_error& error) {
    std::string reason(error.description());
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    if (reason.find("could not determine value type") != std::string::npos)
      reason += "; names stand in quotes, as method = \"exact\"";
    throw UserError(fmt::format("{}: not valid TOML: {}", place_of(file, error.source()), reason));
  }
}

toml::table parse_document(const fs::path& file, const char* kind, std::uintmax_t max_bytes) {
  return parse_text(read_document(file, kind, max_bytes), file);
}

std::string place_of(const fs::path& file, const toml::source_region& source) {
  return fmt::format("{}:{}", file.string(), source.begin.line);
}

void set_from_node(const Field& field, const toml::node& node, Settings& settings, const std::string& where) {
  set_from_text(field, settings, text_of(node, field, where), where);
}

}  // namespace pf
