// `pickleflight bench --flight`: times every frame of a whole flight, without drawing.
#pragma once

#include <atomic>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "app/options.hpp"
#include "backend/backend.hpp"

namespace pf {

// A frame of the flight: its steps by the host's clock.
struct TimedFrame {
  double simulated_s = 0.0;  // at its end
  double ms = 0.0;
  StepTotals totals;
};

// Keys: frames, median_ms, p99_ms (the smallest time that 99 % of the frames do not exceed), worst_ms,
// worst_frame (from 0), worst_at_s (simulated), worst_over_mean, and per frame, as lists: simulated_s, ms,
// and for method `exact` events, solved_events, rounds, retried_steps, largest_cluster. frames: at least one.
nlohmann::json flight_figures(const std::vector<TimedFrame>& frames, bool is_exact);

// Flies until the ball leaves but at most 60 s, for settings.seconds if they are given, or, where no ball
// leaves, for 6 s; all at the frame rate. A flight that pauses ends. Prints the figures and writes the JSON
// report: the run report's keys and `flight`. stop: ends the flight after the current frame. Returns the exit
// code, 1 for a flight that paused. Throws UserError if there are no parcels.
int run_flight_bench(const Options& options, std::unique_ptr<Backend> backend, const std::atomic<bool>& stop);

}  // namespace pf
