#include "core/replace_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "core/link_target.hpp"

namespace pf {

std::string replace_file(const std::filesystem::path& file, std::string_view bytes) {
  std::error_code error;
  const std::filesystem::path target = link_target(file);
  const bool is_device =
      std::filesystem::exists(target, error) && !std::filesystem::is_regular_file(target, error);
  const std::filesystem::path written = is_device ? target : part_of(target);
  errno = 0;
  std::ofstream stream(written, std::ios::binary | std::ios::trunc);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  error.clear();
  if (stream && !is_device) std::filesystem::rename(written, target, error);
  if (stream && !error) return "";
  const std::string problem = error ? error.message() : std::strerror(errno);
  if (!is_device) std::filesystem::remove(written, error);
  return problem;
}

}  // namespace pf
