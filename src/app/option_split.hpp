// The options of two flights at once.
#pragma once

#include <string>

#include "app/option_flags.hpp"

namespace pf {

void add_split_flags(CLI::App& app, Typed& typed);
// All functions here throw UserError with place, allowed values and remedy.
void read_split(const Typed& typed, Options& options);
// Throws if an option that has one flight only stands beside --split, or beside a log of two flights, or if
// the two flights would be the same.
void check_split_run(const Options& options);
// Throws with this reason if --split is given.
void refuse_split(const Typed& typed, const std::string& reason);

}  // namespace pf
