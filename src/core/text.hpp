// Small helpers for messages of one line.
#pragma once

#include <cstddef>
#include <string>

namespace pf {

// text in quotes, fit for a message: control characters become '?', and what is too long is cut.
inline std::string in_quotes(const std::string& text) {
  constexpr std::size_t kLongest = 80;
  std::string shown = text.substr(0, kLongest);
  for (char& c : shown) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = '?';
  }
  return "'" + shown + (text.size() > kLongest ? "...'" : "'");
}

}  // namespace pf
