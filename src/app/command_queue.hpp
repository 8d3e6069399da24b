// Commands that wait for the end of a step.
#pragma once

#include "app/simulation.hpp"

namespace pf {

// The commands ask for something besides the steps of a frame. Holding counts.
bool changes_anything(const Commands& commands);
// They ask for nothing but the next frame, which a paused user takes one by one.
bool only_steps(const Commands& commands);
// They replace the whole state, so that an unfinished step of it need not be completed.
bool starts_anew(const Commands& commands);
// Both, in this order, as one. Of two values the later counts.
Commands joined(Commands earlier, const Commands& later);

}  // namespace pf
