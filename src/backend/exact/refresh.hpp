// First stage of a window: which parcels have an event in it.
#pragma once

#include "backend/exact/window.hpp"

namespace pf {

// Lists in `active` the parcels whose next event comes before the window's end. Kept events that are due and
// stale are predicted anew, that of the ball as well.
void refresh(WindowContext& window);

}  // namespace pf
