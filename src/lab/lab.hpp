// `pickleflight lab STUDY`: runs studies, keeps what is finished, draws.
#pragma once

#include <atomic>
#include <vector>

#include "app/options.hpp"
#include "lab/study.hpp"

namespace pf {

// Runs options.study ("all": every one), prints progress to standard error, results to options.out. stop:
// ends after the point in hand. Returns the exit code: 0, or 1 if it was stopped. Throws UserError for an
// unknown study (listing the known ones) or a folder that cannot be used.
int run_lab(const LabOptions& options, const std::vector<LabDevice>& devices, const std::atomic<bool>& stop);

}  // namespace pf
