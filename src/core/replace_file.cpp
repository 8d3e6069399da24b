#include "core/replace_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <system_error>

#include "core/link_target.hpp"

namespace pf {

std::ostream* standard_stream(const std::filesystem::path& file) {
  if (file == "/dev/stdout") return &std::cout;
  if (file == "/dev/stderr") return &std::cerr;
  return nullptr;
}

bool is_written_aside(const std::filesystem::path& file) {
  const std::string name = file.string();
  if (name == "/dev/stdout" || name == "/dev/stderr" || name.starts_with("/dev/fd/") ||
      name.starts_with("/proc/"))
    return false;
  std::error_code error;
  return !std::filesystem::exists(file, error) || std::filesystem::is_regular_file(file, error);
}

bool holds_something(const std::filesystem::path& file) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(file, ignored) && std::filesystem::file_size(file, ignored) > 0;
}

std::string replace_file(const std::filesystem::path& file, std::string_view bytes) {
  std::error_code error;
  const std::filesystem::path target = link_target(file);
  const bool is_aside = is_written_aside(file);
  const std::filesystem::path written = is_aside ? part_of(target) : file;
  errno = 0;
  if (std::ostream* stream = standard_stream(file))
    return stream->write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush()
               ? ""
               : std::strerror(errno);
  std::ofstream stream(written, std::ios::binary | std::ios::trunc);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  error.clear();
  if (stream && is_aside) std::filesystem::rename(written, target, error);
  if (stream && !error) return "";
  const std::string problem = error ? error.message() : std::strerror(errno);
  if (is_aside) std::filesystem::remove(written, error);
  return problem;
}

void remove_if_empty(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(std::filesystem::symlink_status(file, ignored)) &&
      std::filesystem::file_size(file, ignored) == 0)
    std::filesystem::remove(file, ignored);
}

}  // namespace pf
