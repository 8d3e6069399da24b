// Last stage of a window: the solution becomes the parcels' state.
#pragma once

#include "backend/exact/window.hpp"

namespace pf {

// Writes trajectories, discs and kept events, and adds the clusters' tallies to the workers'.
void commit(WindowContext& window);

// Discards the solution, for another attempt: the state stays that of the window's start.
void discard(WindowContext& window);

}  // namespace pf
