// Scene files: TOML with the sections and keys of fields(), all optional.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/settings.hpp"

namespace pf {

// Reads a scene file over `base`. Throws UserError with file and line for malformed TOML, an unknown section
// or key (naming the nearest known one), a wrong type, a value out of range, a file over 1 MiB (by
// its size, before it is read), empty, not regular or not readable.
Settings load_scene_file(const std::filesystem::path& file, const Settings& base = {});

// The text of a scene file: all settings that differ from the defaults, with units as comments.
std::string scene_text(const Settings& settings);

// Writes all settings that differ from the defaults, with units as comments. Throws UserError if unwritable.
void save_scene_file(const std::filesystem::path& file, const Settings& settings);
// The same under the file's own name, for a file that is not there yet; throws UserError if it is, or if the
// name is too long for a scene.
void save_new_scene_file(const std::filesystem::path& file, Settings settings);

// Folders searched for scenes/NAME.toml, first match first: $PICKLEFLIGHT_ASSETS, then those of
// core/program_files.hpp.
std::vector<std::filesystem::path> asset_folders();

// assets/<relative>; throws UserError listing the places looked at.
std::filesystem::path find_asset(const std::filesystem::path& relative);

// Scenes that ship: name and file, sorted by name.
struct SceneEntry {
  std::string name;
  std::filesystem::path file;
};
std::vector<SceneEntry> list_scenes();

// A scene by name, or by path if it ends in .toml. Throws UserError listing the known scenes.
Settings load_scene(const std::string& name_or_path);

// text as a TOML basic string, with its quotes.
std::string toml_string(const std::string& text);

}  // namespace pf
