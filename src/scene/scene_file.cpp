// Scene files: TOML in, TOML out.
#include "scene/scene_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/program_files.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "scene/toml_document.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNameBytes = 64;
constexpr const char* kSceneEnding = ".toml";

std::string name_from(const toml::node& node, const std::string& where) {
  const auto name = node.value<std::string>();
  if (!node.is_string() || name->empty() || name->size() > kMaxNameBytes) {
    throw UserError(fmt::format("{}: scene.name takes a text in quotes of 1 to {} bytes, as name = \"court\"",
                                where, kMaxNameBytes));
  }
  return *name;
}

void read_section(const fs::path& file, const std::string& section, const toml::table& table,
                  Settings& settings) {
  for (const auto& [key, node] : table) {
    const std::string where = place_of(file, key.source());
    if (section == "scene" && key.str() == "name") {
      settings.name = name_from(node, where);
      continue;
    }
    const std::string path = fmt::format("{}.{}", section, key.str());
    const Field& field = find_field(path, where);
    set_from_node(field, node, settings, where);
  }
}

std::vector<std::string> section_names() {
  std::vector<std::string> names;
  for (const Field& field : fields()) {
    if (names.empty() || names.back() != field.section) names.push_back(field.section);
  }
  return names;
}

std::string assignment(const Field& field, const Settings& settings) {
  const bool is_text = std::holds_alternative<std::string Settings::*>(field.member) ||
                       std::holds_alternative<Choice>(field.member);
  const std::string value = value_text(field, settings);
  const std::string comment = field.unit.empty() ? field.doc : fmt::format("[{}] {}", field.unit, field.doc);
  return fmt::format("{} = {}  # {}\n", field.key, is_text ? toml_string(value) : value, comment);
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const SceneEntry& entry : list_scenes()) names.push_back(entry.name);
  return names;
}

}  // namespace

Settings load_scene_file(const fs::path& file, const Settings& base) {
  const toml::table document = parse_document(file, "scene file");
  if (document.empty()) {
    throw UserError(fmt::format(
        "{}: is empty; give at least one setting, as [air] and below it restitution = 0.9", file.string()));
  }
  const std::vector<std::string> sections = section_names();
  Settings settings = base;
  settings.name = file.stem().string();
  for (const auto& [key, node] : document) {
    const std::string section(key.str());
    const std::string where = place_of(file, key.source());
    if (std::find(sections.begin(), sections.end(), section) == sections.end()) {
      const auto field = std::find_if(fields().begin(), fields().end(),
                                      [&](const Field& one) { return section == one.key; });
      if (field != fields().end())
        throw UserError(fmt::format("{}: {} is a setting of [{}]; write it below that line", where,
                                    in_quotes(section), field->section));
      throw UserError(fmt::format("{}: {} is not a section{}; sections: {}", where, in_quotes(section),
                                  say_nearest("; the nearest is [", section, sections, "]"),
                                  fmt::join(sections, ", ")));
    }
    if (!node.is_table()) {
      throw UserError(
          fmt::format("{}: {} must be a section, written [{}]", where, in_quotes(section), section));
    }
    read_section(file, section, *node.as_table(), settings);
  }
  return settings;
}

std::string scene_text(const Settings& settings) {
  const Settings defaults;
  std::string text = fmt::format("[scene]\nname = {}\n", toml_string(settings.name));
  std::string section = "scene";
  for (const Field& field : fields()) {
    if (value_text(field, settings) == value_text(field, defaults)) continue;
    if (field.section != section) text += fmt::format("\n[{}]\n", field.section);
    section = field.section;
    text += assignment(field, settings);
  }
  return text;
}

void save_scene_file(const fs::path& file, const Settings& settings) {
  const std::string problem = replace_file(file, scene_text(settings));
  if (problem.empty()) return;
  throw OutputError(fmt::format(
      "{}: the scene cannot be written ({}); choose a folder that exists, is writable and has room",
      in_quotes(file.string()), problem));
}

void save_new_scene_file(const fs::path& file, Settings settings) {
  settings.name = file.stem().string();
  if (settings.name.empty() || settings.name.size() > kMaxNameBytes) {
    throw UserError(fmt::format("{}: a scene's name has 1 to {} bytes; choose another name",
                                in_quotes(file.string()), kMaxNameBytes));
  }
  std::error_code error;
  if (fs::exists(fs::symlink_status(file, error))) {
    throw UserError(fmt::format("{}: already exists and is not overwritten; choose another name",
                                in_quotes(file.string())));
  }
  save_scene_file(file, settings);
}

std::vector<fs::path> asset_folders() { return program_folders("assets", "PICKLEFLIGHT_ASSETS"); }

fs::path find_asset(const fs::path& relative) {
  std::vector<std::string> tried;
  for (const fs::path& folder : asset_folders()) {
    std::error_code ignored;
    if (fs::exists(folder / relative, ignored)) return folder / relative;
    tried.push_back((folder / relative).string());
  }
  throw UserError(fmt::format("{}: not found in {}; set PICKLEFLIGHT_ASSETS to the folder 'assets'",
                              relative.string(), fmt::join(tried, ", ")));
}

std::vector<SceneEntry> list_assets(const fs::path& folder) {
  std::map<std::string, fs::path> found;  // emplace keeps the first of a name
  for (const fs::path& assets : asset_folders()) {
    std::error_code missing;
    for (const fs::directory_entry& entry : fs::directory_iterator(assets / folder, missing)) {
      if (ending_of(entry.path()) == kSceneEnding) found.emplace(entry.path().stem().string(), entry.path());
    }
  }
  std::vector<SceneEntry> entries;
  entries.reserve(found.size());
  for (const auto& [name, file] : found) entries.push_back({name, file});
  return entries;
}

Settings load_scene(const std::string& name_or_path) {
  if (ending_of(name_or_path) == kSceneEnding) return load_scene_file(name_or_path);
  for (const SceneEntry& entry : list_scenes()) {
    if (entry.name == name_or_path) return load_scene_file(entry.file);
  }
  const std::vector<std::string> known = scene_names();
  if (known.empty()) find_asset(fs::path("scenes") / (name_or_path + kSceneEnding));  // names the folders
  throw UserError(fmt::format("{} is not a scene{}; known: {}; or give a file ending in .toml",
                              in_quotes(name_or_path), say_nearest("; the nearest is ", name_or_path, known),
                              fmt::join(known, ", ")));
}

std::string toml_string(const std::string& text) {
  std::string out = "\"";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(std::string_view(text).substr(at));
    const auto byte = static_cast<unsigned char>(text[at]);
    if (length == 0) {
      out += "\\uFFFD";
    } else if (byte == '"' || byte == '\\') {
      out += {'\\', text[at]};
    } else if (byte < 0x20 || byte == 0x7F) {
      out += fmt::format("\\u{:04X}", byte);
    } else {
      out.append(text, at, length);
    }
    at += std::max<std::size_t>(length, 1);
  }
  return out + '"';
}

}  // namespace pf
