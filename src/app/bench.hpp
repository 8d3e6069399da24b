// `pickleflight bench`: times steps of a scene without drawing, and prints tables of whole frames.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "app/options.hpp"
#include "backend/backend.hpp"

namespace pf {

// Warm-up, then `bench_repeats` times `bench_steps` steps; prints a short table to stdout and writes the JSON
// report: the run report's keys, with the median of the repeats as ns_per_parcel_step, and
// bench.{repeats,steps,warmup,ns_per_parcel_step_{median,min,max},least_bytes_per_parcel_step,
// copy_bandwidth_bytes_per_s}. Throws UserError if there are no parcels or the backend cannot fly the
// settings.
void run_bench(const Options& options, Backend& backend);

// The cost of recording, from reports (RunRecord::finish) of the same run without and with a film, taken in
// turn, at least one each. Keys: rounds, frame_ms_{without,with} (medians over the rounds of their median
// whole frame), ratio, mean_frame_ms_{without,with}, cost_ms, period_ms (of the film), share_of_period,
// film_frames (of the last round), dropped (of all), write_ms_per_frame (encoder or sink, on their own
// thread), encoder, width, height.
nlohmann::json recording_cost(const std::vector<nlohmann::json>& plain,
                              const std::vector<nlohmann::json>& recorded);

// Prints to stdout, from a run report, the milliseconds of the whole frame, of each phase, of drawing by host
// and GL device, and the cost of recording if the report has it under `recording`.
void print_frame_times(const nlohmann::json& report);

}  // namespace pf
