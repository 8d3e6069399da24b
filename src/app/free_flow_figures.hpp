// Drag on a held ball and its hits, over what is known in closed form.
#pragma once

#include <optional>

#include "app/simulation.hpp"

namespace pf {

// Relative to free-molecular flow past a smooth disc (model/free_flow.hpp), with standard errors from the
// number of hits.
struct FreeFlowFigures {
  double drag_over_theory = 0.0, drag_error = 0.0;
  double hits_over_theory = 0.0, hits_error = 0.0;
};

// Whether theory holds: a smooth ball is held in a uniform stream of parcels that do not touch each other. It
// holds until parcels that have hit the ball return through the periodic world.
bool is_free_flow(const FrameView& view);

// Figures since the run had these totals and this simulated time. None where theory does not hold, and before
// the first hit.
std::optional<FreeFlowFigures> free_flow_figures(const FrameView& view, const StepTotals& since,
                                                 double since_s);

}  // namespace pf
