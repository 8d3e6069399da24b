// `pickleflight lab STUDY`: runs studies, keeps what is finished, draws.
#pragma once

#include <atomic>
#include <vector>

#include "app/options.hpp"
#include "lab/study.hpp"

namespace pf {

// Runs options.study ("all": every one), prints progress to standard error, results to options.out. stop:
// ends after the point in hand. Returns the exit code: 0, or 1 if it was stopped or a yardstick was not met.
// Throws UserError for an unknown study (listing the known ones) or a folder that cannot be used.
int run_lab(const LabOptions& options, const std::vector<LabDevice>& devices, const std::atomic<bool>& stop);

// Draws the results that are in a folder, wherever they were measured, and the report. Returns the exit code:
// 1 if a picture could not be drawn. Throws UserError if there are none.
int plot_lab(const std::filesystem::path& folder);

}  // namespace pf
