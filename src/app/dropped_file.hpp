// Tells the kind of a file that was dropped on the window, and takes it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace pf {

enum class DroppedKind : std::uint8_t { scene, cues, log, other };

// By its name, if that does not end in .toml, and by its content.
DroppedKind kind_of_dropped(const std::filesystem::path& file);

struct DropAnswer {
  std::string scene;  // file to load; empty: none
  std::string cues;   // list to load; empty: none
  std::string line;   // to say; empty: nothing
};

// Never throws. A scene or a list that cannot run is refused when it is loaded.
DropAnswer answer_drop(const std::vector<std::filesystem::path>& files);

}  // namespace pf
