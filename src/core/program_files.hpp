// Locates the files that belong to the program: assets, shaders, plots, fonts. Their folders are relative to
// the program, so that an installed or unpacked tree can be moved.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace pf {

// Folders to search for `kind` ("assets", "shaders", "plots" or "fonts"), in this order: the folder that the
// environment variable names (null: none), share/pickleflight beside the program's folder (installed), and
// share/pickleflight in it (a build folder). The folders need not exist.
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
