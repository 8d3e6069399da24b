// `pickleflight lab STUDY`: runs studies, keeps finished points, draws charts.
#pragma once

#include <atomic>
#include <vector>

#include "app/options.hpp"
#include "lab/study.hpp"

namespace pf {

// Runs options.study ("all": every one), prints progress to standard error, writes results to options.out.
// stop: ends the run after the current point. Returns the exit code: 0, or 1 if the run was stopped or
// disagrees with a reference. Throws UserError for an unknown study or a folder that cannot be used.
int run_lab(const LabOptions& options, const std::vector<LabDevice>& devices, const std::atomic<bool>& stop);

// Draws the results in a folder, of this or another machine, and the report. Returns the exit code: 1 if a
// picture could not be drawn. Throws UserError if the folder holds no results.
int plot_lab(const std::filesystem::path& folder);

}  // namespace pf
