// Text helpers for messages of one line.
#pragma once

#include <cstddef>
#include <string>

namespace pf {

// Quotes text for a message. Control characters become '?', and long text is cut.
inline std::string in_quotes(const std::string& text) {
  constexpr std::size_t kMaxBytes = 80;
  std::string shown = text.substr(0, kMaxBytes);
  for (char& c : shown) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = '?';
  }
  return "'" + shown + (text.size() > kMaxBytes ? "...'" : "'");
}

// True if a key of a TOML text has so many parts that its tables, nested in each other, would overflow the
// stack of a parser that calls itself.
inline bool has_deep_keys(const std::string& toml) {
  constexpr std::size_t kMostDots = 1000;
  std::size_t num_dots = 0;
  bool is_key = true;
  for (const char c : toml) {
    if (c == '\n' || c == '=') num_dots = 0, is_key = c == '\n';
    if (is_key && c == '.' && ++num_dots > kMostDots) return true;
  }
  return false;
}

}  // namespace pf
