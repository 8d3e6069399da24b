// Cue lists: TOML files of prepared states for a talk, each a scene with settings on top of it, a view of it
// and a title.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/vec2.hpp"
#include "scene/settings.hpp"

namespace pf {

constexpr double kTitle_s = 6.0;

// A part of the plane: its middle, and the width that the free part of the picture shows.
struct CueView {
  Vec2d center_m;
  double width_m = 1.0;
};

struct Cue {
  std::string title, subtitle;    // empty: none
  double title_s = kTitle_s;      // how long they are shown; 0: until the next cue
  Settings settings;              // the scene's, with the cue's on top
  std::optional<CueView> camera;  // none: all of the world
  bool paused = false;
  std::string place;  // "FILE:LINE", for messages
};

struct CueList {
  std::filesystem::path file;
  std::vector<Cue> cues;  // not empty once loaded
};

// Loads a list by path if it ends in .toml, or by name from assets/cues. Every cue is checked as far as it
// can be without flying it: names, types and ranges, scenes, and whether its settings can run together.
// Throws UserError with file, line and remedy.
CueList load_cue_list(const std::string& name_or_path);

// Returns whether the file looks like a list of cues, which may have errors: a line begins with [[cue]].
// Never throws.
bool is_cue_list(const std::filesystem::path& file);

// Throws UserError, with the cue's place, if its settings cannot run. For settings that came on top of it.
void check_cue(const Cue& cue);

// The cue as text of a list. Writes only the differences from the scene of that name, or from the court if
// there is none. Settings that hold for the whole run are left out, and so is the number of parcels that
// `backend` chooses for the scene.
std::string cue_text(const Cue& cue, const std::string& backend);

// Appends the cue to a list, or begins one. Throws UserError, without any change, if the file is no list of
// cues without errors, or cannot be written.
void append_cue(const std::filesystem::path& file, const Cue& cue, const std::string& backend);

}  // namespace pf
