// Reads and checks single values of the command line.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace pf {

// Parses the whole text as a number, which may be infinite or NaN. Returns none if it is not a number.
std::optional<double> number_in(const std::string& text);

// All functions below throw UserError with place, allowed values and remedy.
int whole_number(const std::string& place, const std::string& text, int min, int max);

void read_size(const std::string& flag, const std::string& text, int& width_px, int& height_px);

double read_ui_scale(const std::string& text);

// Throws unless the name is one of those known.
void check_name(const char* flag, const std::string& name, const std::vector<std::string>& known);
// The same; returns the name.
std::string name_of(const char* flag, const std::string& text, const std::vector<std::string>& names);

// Tries to open the file for appending, which keeps its content. Removes it again if it is new.
void check_writable(const std::string& place, const std::filesystem::path& file);

// The file given by a flag, or an empty path. endings: allowed ones; empty: any.
std::filesystem::path output_file(const CLI::App& app, const std::string& flag, const std::string& text,
                                  const std::vector<std::string>& endings);

// The same for a table or a report, with any ending. Refuses to replace a file that ends otherwise than
// `ending`: it may be one that somebody wrote.
std::filesystem::path table_file(const CLI::App& app, const std::string& flag, const std::string& text,
                                 const std::string& ending);

// A film, or a pattern for its frames. The frames' folder is created later, if its parent exists.
std::filesystem::path record_file(const CLI::App& app, const std::string& text);

// Refuses an argument that CLI11 did not recognise.
[[noreturn]] void refuse_extra(const CLI::App& command, const std::string& argument);

}  // namespace pf
