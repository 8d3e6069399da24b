// The options of two flights at once.
#pragma once

#include <string>

#include "app/option_flags.hpp"

namespace pf {

void add_split_flags(CLI::App& app, Typed& typed);
// All functions here throw UserError with place, allowed values and remedy.
void read_split(const Typed& typed, Options& options);
// Throws if --split, or a log of two flights, is combined with an option for one flight, or if the two
// flights would be the same.
void check_split_run(const Options& options);
// Throws UserError with this reason if --split is given.
void refuse_split(const Typed& typed, const std::string& reason);

}  // namespace pf
