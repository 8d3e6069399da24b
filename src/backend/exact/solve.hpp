// Third stage of a window: solving clusters, each by one thread.
#pragma once

#include "backend/exact/window.hpp"

namespace pf {

// Solves the clusters in `todo`. A cluster that runs into another one stops and records a conflict.
void solve(WindowContext& window);

}  // namespace pf
