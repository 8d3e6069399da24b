// Links to files.
#pragma once

#include <filesystem>
#include <system_error>

namespace pf {

// The file that a name stands for, whether or not it exists: a rename to a link would replace the link, and
// leave its file as it was. Links in a ring stand for themselves.
inline std::filesystem::path link_target(const std::filesystem::path& file) {
  constexpr int kMaxLinks = 40;  // as many as Linux follows
  std::filesystem::path target = file;
  std::error_code error;
  for (int k = 0; k < kMaxLinks; ++k) {
    const std::filesystem::path next = std::filesystem::read_symlink(target, error);
    if (error) return target;  // no link
    target = target.parent_path() / next;
  }
  return file;
}

}  // namespace pf
