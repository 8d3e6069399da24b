// Files that are written aside and renamed when they are whole.
#pragma once

#include <filesystem>

namespace pf {

// The file that a name stands for: a rename to a link would replace the link, and leave its file as it was. A
// link to nothing stands for itself.
inline std::filesystem::path link_target(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path target = std::filesystem::weakly_canonical(file, error);
  return error ? file : target;
}

}  // namespace pf
