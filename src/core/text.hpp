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

}  // namespace pf
