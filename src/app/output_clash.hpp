// Files of a command line that would overwrite each other.
#pragma once

#include "app/option_flags.hpp"
#include "app/options.hpp"

namespace pf {

// Refuses an output that is also an input, or another output. A checkpoint may take the place of the one that
// the run goes on from. Throws UserError.
void check_outputs(const Typed& typed, const Options& options);

}  // namespace pf
