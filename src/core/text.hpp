// Text helpers for messages of one line.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace pf {

// Returns whether a byte of UTF-8 goes on with the character of the one before.
inline bool is_continuation(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U; }

// Quotes text for a message. Control characters become '?', and long text is cut.
inline std::string in_quotes(const std::string& text) {
  constexpr std::size_t kMaxBytes = 80;
  std::size_t end = std::min(text.size(), kMaxBytes);
  if (end < text.size())
    while (end > kMaxBytes - 3 && is_continuation(text[end])) --end;  // no part of a character
  std::string shown = text.substr(0, end);
  for (char& c : shown) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = '?';
  }
  return "'" + shown + (text.size() > kMaxBytes ? "...'" : "'");
}

// A word as a shell takes it.
inline std::string shell_word(const std::string& word) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("/._-+").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), is_plain)) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

// Number of bytes of the first character of a text in UTF-8; 0 if the text does not begin with one.
inline std::size_t utf8_length(std::string_view text) {
  constexpr char32_t kMin[] = {0, 0, 0x80, 0x800, 0x10000};  // of a character of so many bytes
  const auto first = static_cast<unsigned char>(text.empty() ? 0xFF : text[0]);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC0 || first >= 0xF8 || text.size() < length) return 0;
  char32_t point = first & (0xFFU >> (length + 1));
  for (const char c : text.substr(1, length - 1)) {
    if (!is_continuation(c)) return 0;
    point = point << 6 | (c & 0x3FU);
  }
  const bool is_surrogate = point >= 0xD800 && point < 0xE000;
  return point >= kMin[length] && point <= 0x10FFFF && !is_surrogate ? length : 0;
}

// Returns whether a text is UTF-8, which TOML and JSON require and file names need not be.
inline bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

// Escapes text for XML. Bytes that are not UTF-8 become U+FFFD.
inline std::string xml_text(std::string_view text) {
  std::string escaped;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const char c = text[0];
    if (length == 0)
      escaped += "\xEF\xBF\xBD";
    else if (c == '&')
      escaped += "&amp;";
    else if (c == '<')
      escaped += "&lt;";
    else if (c == '>')
      escaped += "&gt;";
    else if (c == '"')
      escaped += "&quot;";
    else if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t')  // XML has no others
      escaped += text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return escaped;
}

// Returns the end of the quoted text that begins at a place of a TOML text.
inline std::size_t end_of_quotes(std::string_view toml, std::size_t at) {
  const char mark = toml[at];
  const std::string three(3, mark);
  const std::string quotes = toml.substr(at).starts_with(three) ? three : three.substr(0, 1);
  for (std::size_t k = at + quotes.size(); k < toml.size(); ++k) {
    if (mark == '"' && toml[k] == '\\') {
      ++k;
    } else if (toml.substr(k).starts_with(quotes)) {
      return k + quotes.size();
    } else if (toml[k] == '\n' && quotes.size() == 1) {
      return k;
    }
  }
  return toml.size();
}

// Returns whether a key of a TOML text has so many parts that a recursive parser would overflow its stack.
inline bool has_deep_keys(std::string_view toml) {
  constexpr std::size_t kMaxDots = 1000;
  std::size_t num_dots = 0;  // since anything else than a key's parts
  for (std::size_t at = 0; at < toml.size();) {
    const char c = toml[at];
    if (c == '"' || c == '\'') {
      at = end_of_quotes(toml, at);
      continue;
    }
    if (c == '#') at = std::min(toml.find('\n', at), toml.size() - 1);
    if (std::string_view("\n=,{}[]").find(toml[at]) != std::string_view::npos) num_dots = 0;
    if (toml[at] == '.' && ++num_dots > kMaxDots) return true;
    ++at;
  }
  return false;
}

}  // namespace pf
