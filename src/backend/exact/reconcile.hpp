// Fourth stage of a step: finding clusters whose solutions contradict each other, and merging them.
#pragma once

#include "backend/exact/step_state.hpp"

namespace pf {

// Appends conflicts between solved clusters whose new trajectories collide.
void find_conflicts(StepContext& step);

// Merges all clusters that conflict into the one with the lowest index. These are the new `todo`; it is empty
// if nothing conflicts.
void merge(StepContext& step);

}  // namespace pf
