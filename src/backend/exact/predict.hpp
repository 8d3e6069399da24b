// First stage of a step: every parcel's earliest event on the start trajectories.
#pragma once

#include "backend/exact/step_state.hpp"

namespace pf {

// Sets event_key, event_partner, active, near_ball and the discs, and the positions at the step's end.
void predict(StepContext& step);

}  // namespace pf
