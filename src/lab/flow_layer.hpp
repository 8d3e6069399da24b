// Drag in the layer in front of a ball, over many seeds.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "lab/flow_case.hpp"
#include "lab/study.hpp"

namespace pf {

// Runs the case with num_seeds > 0 seeds. Keys: drag and drag_sigma (mean and standard error of the
// coefficient), num_seeds, ns_per_disc_time (of the quickest of the runs that had the machine to themselves).
nlohmann::json measure_layer(const DragCase& layer, const FlowSteps& steps, int num_seeds,
                             const LabDevice& device);

}  // namespace pf
