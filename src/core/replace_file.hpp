// Files that are written aside and renamed when they are whole.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace pf {

// The file aside.
inline std::filesystem::path part_of(const std::filesystem::path& file) { return file.string() + ".part"; }

// False for a device, a pipe, and what is open already, as /dev/stdout: they are written directly.
bool is_written_aside(const std::filesystem::path& file);

// Writes a file, so that a full disk leaves what was there. A link stays one. Returns "", or the reason why
// it failed.
std::string replace_file(const std::filesystem::path& file, std::string_view bytes);

// Removes a file without a byte, as a full disk leaves it.
void remove_if_empty(const std::filesystem::path& file);

}  // namespace pf
