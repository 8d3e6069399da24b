// The options of `pickleflight bench`.
#pragma once

#include "app/option_flags.hpp"

namespace pf {

// All functions here throw UserError with place, allowed values and remedy.
// A sweep has its own settings. Others are refused, not silently ignored.
void check_sweep(const CLI::App& app, const Typed& typed, const Options& options);

// Reads the options for whole frames and flights, and refuses those without an effect; after the settings.
void read_frame_bench(const CLI::App& app, const Typed& typed, Options& options);

}  // namespace pf
