// Files that are written aside and renamed when they are whole.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>

namespace pf {

// Temporary name under which a file is written.
inline std::filesystem::path part_of(const std::filesystem::path& file) { return file.string() + ".part"; }

// The stream of /dev/stdout and /dev/stderr; null for other files. Opened by such a name, a file behind it
// would be written from its beginning.
std::ostream* standard_stream(const std::filesystem::path& file);

// Returns false for devices, pipes and open files such as /dev/stdout: these are written directly.
bool is_written_aside(const std::filesystem::path& file);

// Returns whether there is a regular file with content, also behind a link.
bool holds_something(const std::filesystem::path& file);

// Writes a file, so that a full disk leaves what was there. A link stays one. Returns "", or the reason why
// it failed.
std::string replace_file(const std::filesystem::path& file, std::string_view bytes);

// Removes an empty file, which a full disk leaves behind.
void remove_if_empty(const std::filesystem::path& file);

}  // namespace pf
