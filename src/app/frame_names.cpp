#include "app/frame_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cctype>
#include <charconv>
#include <optional>

#include "core/file_ending.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

struct Placeholder {
  std::size_t start, end;  // of '%...d' in the name
  int min_digits;
};

std::optional<Placeholder> placeholder_in(const std::string& name) {
  const std::size_t start = name.find('%');
  if (start == std::string::npos || name.find('%', start + 1) != std::string::npos) return std::nullopt;
  if (name.compare(start, 2, "%d") == 0) return Placeholder{start, start + 2, 1};
  const bool is_padded = name.size() > start + 3 && name[start + 1] == '0' && name[start + 2] >= '1' &&
                         name[start + 2] <= '9' && name[start + 3] == 'd';
  if (!is_padded) return std::nullopt;
  return Placeholder{start, start + 4, name[start + 2] - '0'};
}

// The folder of a film's frames. That of "%05d.png" or "./%05d.png" has no name to number, and gets one.
fs::path folder_of_frames(const fs::path& pattern) {
  const fs::path folder = pattern.parent_path(), name = folder.filename();
  return name.empty() || name == "." || name == ".." ? folder / "frames" : folder;
}

}  // namespace

bool is_frame_pattern(const fs::path& file) {
  return ending_of(file) == ".png" && placeholder_in(file.filename().string()).has_value() &&
         file.parent_path().string().find('%') == std::string::npos;
}

fs::path frame_file(const fs::path& pattern, int index) {
  const std::string name = pattern.filename().string();
  const std::optional<Placeholder> number = placeholder_in(name);
  assert(number);
  return pattern.parent_path() / fmt::format("{}{:0{}}{}", name.substr(0, number->start), index,
                                             number->min_digits, name.substr(number->end));
}

std::optional<int> frame_of(const fs::path& pattern, const fs::path& file) {
  const std::string form = pattern.filename().string(), name = file.filename().string();
  const std::optional<Placeholder> number = placeholder_in(form);
  assert(number);
  const std::string before = form.substr(0, number->start), after = form.substr(number->end);
  if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after))
    return std::nullopt;
  int index = 0;
  const char* const end = name.data() + name.size() - after.size();
  const auto [parsed, error] = std::from_chars(name.data() + before.size(), end, index);
  const bool is_frame =
      error == std::errc() && parsed == end && index >= 0 && frame_file(pattern, index).filename() == name;
  return is_frame ? std::optional(index) : std::nullopt;
}

fs::path frames_instead_of(const fs::path& film) {
  return film.parent_path() / (film.stem().string() + "_frames") / "%05d.png";
}

fs::path log_beside(const fs::path& film) {
  if (!is_frame_pattern(film)) return film.string() + ".toml";
  return folder_of_frames(film).string() + ".toml";
}

fs::path frames_beside(const fs::path& panel_map) { return panel_map.string() + ".frames"; }

fs::path numbered(const fs::path& file, int number) {
  if (number == 1) return file;
  const fs::path folder = file.parent_path();
  if (is_frame_pattern(file))
    return fs::path(fmt::format("{}-{}", folder_of_frames(file).string(), number)) / file.filename();
  return folder / fmt::format("{}-{}{}", file.stem().string(), number, file.extension().string());
}

// A name that cannot be looked up counts as free: whoever writes the file tells why it cannot be.
fs::path free_name(const fs::path& file) {
  std::error_code ignored;
  int number = 1;
  while (fs::exists(numbered(file, number), ignored)) ++number;
  return numbered(file, number);
}

std::string file_part(std::string name) {
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_';
  };
  std::replace_if(
      name.begin(), name.end(), [&](char c) { return !is_plain(c); }, '_');
  return name.empty() ? "scene" : name;
}

}  // namespace pf
