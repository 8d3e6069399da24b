// `pickleflight bench --sweep`: whole frames over the number of parcels, for each backend and neighbour
// search.
#pragma once

#include <atomic>
#include <string>

#include "app/options.hpp"

namespace pf {

// Measures N = 1,000, 10,000 ... options.sweep_max. Every point is a headless run of this program in a
// process of its own, so that drawing is included and a crash ends one point alone. Points that would take
// over 20 s are extrapolated (all-pairs as N^2, grid as N) and marked. Prints a table. Rewrites
// options.bench_json after every point, so that finished points are kept. cuda_obstacle: reason why there is
// no CUDA device; empty if there is one. stop: ends the sweep after the current frame. Returns the exit code:
// 0, or 1 if it was stopped or a point failed. Throws UserError if the JSON cannot be written.
int run_sweep(const Options& options, const std::string& cuda_obstacle, const std::atomic<bool>& stop);

}  // namespace pf
