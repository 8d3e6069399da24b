#include "app/frame_names.hpp"

#include <fmt/format.h>

#include <cassert>
#include <optional>

namespace pf {
namespace {

namespace fs = std::filesystem;

struct NumberPlace {
  std::size_t begin, end;  // of '%...d' in the name
  int digits;              // at least so many
};

std::optional<NumberPlace> number_place(const std::string& name) {
  const std::size_t begin = name.find('%');
  if (begin == std::string::npos || name.find('%', begin + 1) != std::string::npos) return std::nullopt;
  if (name.compare(begin, 2, "%d") == 0) return NumberPlace{begin, begin + 2, 1};
  const bool is_padded = name.size() > begin + 3 && name[begin + 1] == '0' && name[begin + 2] >= '1' &&
                         name[begin + 2] <= '9' && name[begin + 3] == 'd';
  if (!is_padded) return std::nullopt;
  return NumberPlace{begin, begin + 4, name[begin + 2] - '0'};
}

}  // namespace

bool is_frame_pattern(const fs::path& file) {
  const std::string ending = file.extension().string();
  return (ending == ".png" || ending == ".PNG") && number_place(file.filename().string()).has_value() &&
         file.parent_path().string().find('%') == std::string::npos;
}

fs::path frame_file(const fs::path& pattern, int index) {
  const std::string name = pattern.filename().string();
  const std::optional<NumberPlace> place = number_place(name);
  assert(place);
  return pattern.parent_path() / fmt::format("{}{:0{}}{}", name.substr(0, place->begin), index, place->digits,
                                             name.substr(place->end));
}

fs::path frames_instead_of(const fs::path& film) {
  return film.parent_path() / (film.stem().string() + "_frames") / "%05d.png";
}

fs::path log_beside(const fs::path& film) {
  if (!is_frame_pattern(film)) return film.string() + ".toml";
  return film.has_parent_path() ? film.parent_path().string() + ".toml" : "frames.toml";
}

}  // namespace pf
