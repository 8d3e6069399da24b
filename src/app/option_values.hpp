// Single values of the command line: read, checked, and refused with what would do.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace pf {

// Throws UserError, as all here, with the place, what is allowed and the remedy.
int whole_number(const std::string& place, const std::string& text, int min, int max);

void read_size(const std::string& flag, const std::string& text, int& width_px, int& height_px);

double read_ui_scale(const std::string& text);

std::string name_of(const char* flag, const std::string& text, const std::vector<std::string>& names);

void check_name(const char* flag, const std::string& name, const std::vector<std::string>& known);

// Opens in append mode, so that what is there stays; a file that this made is removed again.
void check_writable(const std::string& place, const std::filesystem::path& file);

// The file named by a flag, or none. endings: those allowed; empty: any.
std::filesystem::path output_file(const CLI::App& app, const std::string& flag, const std::string& text,
                                  const std::vector<std::string>& endings);

// A film, or a pattern for its frames, whose folder is made later if the one above it is there.
std::filesystem::path record_file(const CLI::App& app, const std::string& text);

// What CLI11 did not recognise.
[[noreturn]] void refuse_extra(const CLI::App& command, const std::string& word);

}  // namespace pf
