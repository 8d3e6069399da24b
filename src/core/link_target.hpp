// Links to files.
#pragma once

#include <filesystem>
#include <system_error>

namespace pf {

// Returns the file that a name refers to, even if it does not exist: a rename to a link would replace the
// link, and leave its file as it was. Returns `file` itself if links form a cycle.
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
