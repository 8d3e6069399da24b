#include "app/dropped_file.hpp"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>

#include "app/input_log.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"
#include "scene/cue_list.hpp"

namespace pf {

namespace fs = std::filesystem;

DroppedKind kind_of_dropped(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error) || fs::file_size(file, error) > kMaxLogBytes || error)
    return DroppedKind::other;
  const bool is_toml = ending_of(file) == ".toml";
  try {
    std::ifstream stream(file, std::ios::binary);
    const std::string text(std::istreambuf_iterator<char>(stream), {});
    if (has_deep_keys(text)) return is_toml ? DroppedKind::scene : DroppedKind::other;
    const toml::table document = toml::parse(text);
    if (document.contains("frame") && document.contains("settings")) return DroppedKind::log;
  } catch (const toml::parse_error&) {
    // Loading a scene or a list names the line.
  }
  if (is_toml && is_cue_list(file)) return DroppedKind::cues;
  return is_toml ? DroppedKind::scene : DroppedKind::other;
}

DropAnswer answer_drop(const std::vector<fs::path>& files) {
  if (files.size() != 1) return {"", "", "Drop one file at a time: a scene or a cue list, NAME.toml"};
  const fs::path& file = files.front();
  switch (kind_of_dropped(file)) {
    case DroppedKind::scene:
      return {file.string(), "", ""};
    case DroppedKind::cues:
      return {"", file.string(), ""};
    case DroppedKind::log:
      return {"", "",
              fmt::format("{} is the log of a flight; type: pickleflight run {}",
                          in_quotes(file.filename().string()), shell_word(file.string()))};
    default:
      return {"", "",
              fmt::format("{} cannot be dropped here; a scene or a cue list can, NAME.toml",
                          in_quotes(file.filename().string()))};
  }
}

}  // namespace pf
