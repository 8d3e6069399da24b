// `pickleflight lab STUDY`: runs studies, keeps finished points, draws charts.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "app/options.hpp"
#include "backend/domains/carrier.hpp"
#include "lab/study.hpp"

namespace pf {

// The devices that this process measures with.
struct LabMachine {
  std::vector<LabDevice> devices;    // the CPU first
  std::shared_ptr<Carrier> carrier;  // to the other ranks
  unsigned num_threads = 0;          // of this rank; 0: one per core
};

// Runs options.study ("all": every one) on all ranks, prints progress to standard error, writes results to
// options.out. stop: ends the run after the current points. Returns the exit code: 0, or 1 if the run was
// stopped or disagrees with a reference. Throws UserError for an unknown study or a folder that cannot be
// used.
int run_lab(const LabOptions& options, const LabMachine& machine, const std::atomic<bool>& stop);
// Runs on the other ranks: measures the points that rank 0 hands out, until rank 0 is done.
void help_run_lab(const LabOptions& options, const LabMachine& machine);

// Draws the results in a folder, of this or another machine, and the report. Returns the exit code: 1 if a
// picture could not be drawn. Throws UserError if the folder holds no results.
int plot_lab(const std::filesystem::path& folder);

}  // namespace pf
