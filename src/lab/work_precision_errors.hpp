// From what the work-precision study measured to errors, orders of convergence and the front of the cheapest.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// Adds to each of result["points"] "errors": for rate, pressure, energy (groups "gas"), path and drag (group
// "ball"), parcel-path: {"value", "sigma", "bound", "front"}. value: relative error, or for parcel-path
// diameters; sigma: its statistical error; bound: an upper limit, value being |error| + 2 sigma, since the
// error is below 2 sigma; front: no other point of the same group, device, area fraction and restitution is
// both cheaper and more accurate. Adds result["orders"]: slope of parcel-path over dt by device, method
// and area fraction; and result["words"] (work_precision_summary.hpp). Yardsticks: Kolafa and Rottner 2006
// where restitution is 1; else `exact` of the same case, shortest step.
void conclude_work_precision(nlohmann::json& result);

}  // namespace pf
