// Last stage of a step: the solution becomes the parcels' state.
#pragma once

#include "backend/exact/step_state.hpp"

namespace pf {

// Writes trajectories and end positions of changed parcels, and adds the clusters' tallies to the workers'.
void commit(StepContext& step);

// Discards the solution, for another attempt: the state stays that of the step's start.
void discard(StepContext& step);

}  // namespace pf
