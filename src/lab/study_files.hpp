// The folder of results: per study NAME.json, NAME.csv and, from plots/NAME.py, NAME.svg and NAME.png; for
// all of them report.html.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "lab/study.hpp"

namespace pf {

enum class Existing { refuse, resume, overwrite };

// Makes the folder. Throws UserError if it is there and holds anything (with refuse), is no folder, or cannot
// be written.
void open_results(const std::filesystem::path& folder, Existing existing);

// Takes the points of an earlier run of the study in the folder into `result`, unless it was measured with
// another --quick or version. Those of a series that is not measured now stay, with their device.
void take_up(const std::filesystem::path& folder, const Study& study, nlohmann::json& result);

// NAME.json and NAME.csv (one row a point, nested objects as columns a.b, arrays left out). Written beside
// and moved into place: a crash leaves the old ones.
void save_study(const std::filesystem::path& folder, const nlohmann::json& result);

std::string csv_of(const nlohmann::json& points);

// Runs the plot script of a study or of the report. Returns what went wrong, with the remedy; empty if
// nothing.
std::string run_plot(const std::string& script, const std::filesystem::path& folder);

}  // namespace pf
