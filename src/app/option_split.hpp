// The options of two flights at once.
#pragma once

#include <string>

#include "app/option_flags.hpp"

namespace pf {

void add_split_flags(CLI::App& app, Typed& typed);
// All functions here throw UserError with place, allowed values and remedy.
void read_split(const Typed& typed, Options& options);
// Refuses what has one flight only beside --split, or beside a log of two flights.
void check_split_run(const Options& options);
// If one of them is given.
void refuse_split(const Typed& typed, const std::string& reason);

}  // namespace pf
