// What a run is refused for before its outputs are opened, so that older ones stay whole.
#pragma once

#include "view/stage.hpp"

namespace pf {

// Ends of a run without a window.
constexpr double kLongestFilm_s = 60.0;  // without run.seconds or a ball that leaves
constexpr double kAfterFlight_s = 0.5;

// Throws UserError if the run goes on from a state where it would end at once and leave outputs empty,
// replays a log from another state than the log's, or is to write a still of a moment that has passed.
void check_start(const Options& options, const StageHooks& hooks, bool has_window, Simulation& simulation);

}  // namespace pf
