// The folder of results. A study writes NAME.json and NAME.csv, and plots/NAME.py draws NAME.svg and
// NAME.png. report.html holds all studies.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "lab/study.hpp"

namespace pf {

enum class Existing { refuse, resume, overwrite };

// Creates the folder. Throws UserError if it exists and is not empty (with refuse), has files, but none of a
// study (with resume), is not a folder, or cannot be read and written.
void open_results(const std::filesystem::path& folder, Existing existing);

// Takes the points of an earlier run of the study in the folder into `result`, with the machine that measured
// them and the settings of the scene that it measured in. Points of a series that is not measured now stay.
// Throws UserError if the file has another --quick or version, or is damaged: its points would be lost.
// Returns whether series that are not measured now are complete.
bool resume_study(const std::filesystem::path& folder, const Study& study, nlohmann::json& result);
// Throws UserError with a reason why the file of a study in the folder cannot be continued, and a remedy.
[[noreturn]] void refuse_to_resume(const std::filesystem::path& folder, const std::string& study,
                                   const std::string& reason);

// Adds to a machine's devices those of a series that measures a point of a study begun elsewhere.
void add_device(const nlohmann::json& devices, const std::string& series, nlohmann::json& machine);

// Writes NAME.json and NAME.csv (one row per point, nested objects as columns a.b, without arrays). New files
// are moved into place when they are complete: a crash leaves the old ones.
void save_study(const std::filesystem::path& folder, const nlohmann::json& result);

std::string csv_of(const nlohmann::json& points);

// Removes the pictures of a study whose figures are about to be overwritten.
void remove_pictures(const std::filesystem::path& folder, const std::string& study);

// Keeps the table of study work-precision in the folder as the file `kept`, for --accuracy, unless it was
// measured with --quick: the one that the program comes with is better. Returns why it was not kept; empty if
// it was, or if `kept` is empty.
std::string keep_accuracy_table(const std::filesystem::path& folder, const std::filesystem::path& kept);

// Runs the plot script of a study or of the report. Returns the error, with the remedy; empty on success.
std::string run_plot(const std::string& script, const std::filesystem::path& folder);

}  // namespace pf
