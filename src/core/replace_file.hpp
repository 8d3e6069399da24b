// Files that are written aside and renamed when they are whole.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace pf {

// The file aside.
inline std::filesystem::path part_of(const std::filesystem::path& file) { return file.string() + ".part"; }

// Writes a file, so that a full disk leaves what was there. A device is written directly, and a link stays
// one. Returns "", or the reason why it failed.
std::string replace_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace pf
