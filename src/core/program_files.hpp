// Where the files that belong to the program lie: assets, shaders, plots, fonts. They are found from the
// place of the program itself, so that a tree that was installed or unpacked can be moved.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace pf {

// Folders that may hold `kind` ("assets", "shaders", "plots" or "fonts"), the first match first: the one that
// the environment variable names (null: there is none), then share/pickleflight beside the folder of the
// program (installed) and in it (a build folder). None of them need exist.
inline std::vector<std::filesystem::path> program_folders(const std::string& kind,
                                                          const char* variable = nullptr) {
  std::vector<std::filesystem::path> folders;
  const char* chosen = variable != nullptr ? std::getenv(variable) : nullptr;
  if (chosen != nullptr && *chosen != '\0') folders.emplace_back(chosen);
  std::error_code error;
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  folders.push_back((here / PF_DATA_FROM_PROGRAM / kind).lexically_normal());
  folders.push_back(here / "share/pickleflight" / kind);
  return folders;
}

}  // namespace pf
