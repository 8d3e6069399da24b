// Reading of TOML files, with errors that name file and line. For sources that read such a file.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "scene/settings.hpp"

namespace pf {

constexpr std::uintmax_t kMaxDocumentBytes = 1 << 20;

// The text of a file of at most max_bytes. kind: for messages, as "scene file". Throws UserError for a file
// that is not regular, not readable, or larger (checked before it is read).
std::string read_document(const std::filesystem::path& file, const char* kind,
                          std::uintmax_t max_bytes = kMaxDocumentBytes);

// Parses the text of a file. Throws UserError, with the line, if it is not TOML.
toml::table parse_text(const std::string& text, const std::filesystem::path& file);
// Reads and parses a file.
toml::table parse_document(const std::filesystem::path& file, const char* kind,
                           std::uintmax_t max_bytes = kMaxDocumentBytes);

// "FILE:LINE"
std::string place_of(const std::filesystem::path& file, const toml::source_region& source);

// Sets a field from a value of its type. Throws UserError that begins with where.
void set_from_node(const Field& field, const toml::node& node, Settings& settings, const std::string& where);

}  // namespace pf
