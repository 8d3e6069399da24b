// The ending of a file's name. Every place that asks for a kind of file asks here, so that all of them agree
// on FILE.PNG.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>

namespace pf {

// In lower case, with its dot: ".png" of FILE.PNG. Empty if the name has none.
inline std::string ending_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return ending;
}

// NAME.toml of NAME or NAME.toml.
inline std::filesystem::path with_toml_ending(const std::filesystem::path& name) {
  return ending_of(name) == ".toml" ? name : std::filesystem::path(name.string() + ".toml");
}

}  // namespace pf
