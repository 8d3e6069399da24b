// Scene files: TOML with the sections and keys of fields(), all optional.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/settings.hpp"

namespace pf {

// Reads a scene file over `base`. Throws UserError with file and line for malformed TOML, an unknown section
// or key (the message names the nearest known one), a wrong type, and a value out of range. Throws it also
// for a file that is empty, not regular, not readable, or over 1 MiB (checked before it is read).
Settings load_scene_file(const std::filesystem::path& file, const Settings& base = {});

// Text of a scene file: all settings that differ from the defaults, with units as comments.
std::string scene_text(const Settings& settings);

// Writes scene_text(). Throws UserError if the file cannot be written.
void save_scene_file(const std::filesystem::path& file, const Settings& settings);
// Writes a new scene with the file's name as its own. Throws UserError if the file exists or cannot be
// written whole, which leaves none, or if the name is too long for a scene.
void save_new_scene_file(const std::filesystem::path& file, Settings settings);

// Folders to search for scenes/NAME.toml, in order: $PICKLEFLIGHT_ASSETS, then those of
// core/program_files.hpp.
std::vector<std::filesystem::path> asset_folders();

// Path of assets/<relative>. Throws UserError with the searched folders if it does not exist.
std::filesystem::path find_asset(const std::filesystem::path& relative);

// A file of the assets that ends in .toml.
struct SceneEntry {
  std::string name;
  std::filesystem::path file;
};
// The files of a folder of the assets, sorted by name; of those with the same name the first.
std::vector<SceneEntry> list_assets(const std::filesystem::path& folder);
inline std::vector<SceneEntry> list_scenes() { return list_assets("scenes"); }

// Loads a scene by name, or by path if it ends in .toml. Throws UserError with the known scenes.
Settings load_scene(const std::string& name_or_path);

// Formats text as a TOML basic string with its quotes. A byte that is not UTF-8 becomes U+FFFD.
std::string toml_string(const std::string& text);

}  // namespace pf
