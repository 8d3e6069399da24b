// Third stage of a step: solving clusters, each by one thread.
#pragma once

#include "backend/exact/step_state.hpp"

namespace pf {

// Solves the clusters in `todo`. A cluster that runs into another one stops and records a conflict.
void solve(StepContext& step);

}  // namespace pf
