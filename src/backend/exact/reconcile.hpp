// Fourth stage of a window: finding clusters whose solutions contradict each other, and merging them.
#pragma once

#include "backend/exact/window.hpp"

namespace pf {

// Ends the window where the first cluster had too many events. Returns whether it did; `todo` are then the
// solved clusters that went further.
bool cut(WindowContext& window);

// Appends conflicts between solved clusters whose new trajectories collide.
void find_conflicts(WindowContext& window);

// Merges all clusters that conflict into the one with the lowest index. These are the new `todo`; it is empty
// if nothing conflicts.
void merge(WindowContext& window);

}  // namespace pf
