// Errors, orders of convergence and the front of the cheapest, from the measurements of the work-precision
// study.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// Adds to each of result["points"] its "errors": rate, pressure, energy (group "gas", and gases between walls
// of group "parcels"), path and drag (group "ball"), parcel-path. Each is {"value", "sigma", "bound",
// "front"}. Flights of group "parcels" have path and drag with "scatter" over the seeds, "shift" of their
// mean from the limit of many parcels, and "shift_sigma"; value: both together, the shift where it is
// resolved; sigma: of the scatter. value elsewhere: relative error; of parcel-path in diameters. sigma: its
// statistical error. bound: the error is below 2 sigma, and value is the upper limit |error| + 2 sigma.
// front: no other point of the same group, device, area fraction and restitution is both cheaper and more
// accurate. Adds result["orders"], the slope of parcel-path over dt by device, method and area fraction, and
// result["words"] (work_precision_summary.hpp). The reference is Kolafa and Rottner 2006 where restitution is
// 1, otherwise `exact` of the same case with the shortest step.
void conclude_work_precision(nlohmann::json& result);

}  // namespace pf
