// The state that --from names.
#pragma once

#include "app/options.hpp"

namespace pf {

// Reads it, and sets options.settings and options.data.start. Throws UserError.
void read_start(Options& options);

}  // namespace pf
