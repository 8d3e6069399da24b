// Conclusions of study `gas-dynamics`: means over the seeds against theory.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// Pressures in front of balls of so many mean free paths are judged, if the shock is at rest.
inline constexpr double kMinJudgedRadius = 10.0;

// Adds `table`, a row per figure: group, case, method, displacement_per_step, figure, expected (by theory, or
// by `exact` for the layer), measured, error and sigma (relative), allowed, seeds, ns_per_disc_time, verdict
// ("pass", "FAIL", or "-" where it is only shown); `failed` and `words`. A verdict is "pass" if the error is
// at most what is allowed, or 3 standard errors if these are larger and known: from five runs on, or by the
// number of hits.
void conclude_gas_dynamics(nlohmann::json& result);

}  // namespace pf
