// `pickleflight bench`: steps of a scene without drawing, timed.
#pragma once

#include "app/options.hpp"
#include "backend/backend.hpp"

namespace pf {

// Warm-up, then `bench_repeats` times `bench_steps` steps; prints a short table to stdout and writes the JSON
// report (the run report's keys plus bench.{repeats,steps,warmup,ns_per_particle_step_{median,min,max}}).
void run_bench(const Options& options, Backend& backend);

}  // namespace pf
