// `pickleflight bench`: steps of a scene without drawing, timed.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "app/options.hpp"
#include "backend/backend.hpp"

namespace pf {

// Warm-up, then `bench_repeats` times `bench_steps` steps; prints a short table to stdout and writes the JSON
// report (the run report's keys plus bench.{repeats,steps,warmup,ns_per_particle_step_{median,min,max}}).
void run_bench(const Options& options, Backend& backend);

// Prints the whole frame's and each phase's milliseconds of a run report (RunRecord::finish) to stdout.
void print_frame_times(const nlohmann::json& report);

}  // namespace pf
