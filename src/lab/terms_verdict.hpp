// Conclusions from the flights of the terms study.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// Tolerance of the verdicts: a share of the flight's length, and of the speed at its end.
inline constexpr double kTermTolerance = 0.01;

// Adds to each of result["points"] but the first (all terms): exit_shift, exit_shift_sigma (of the exit's
// position, over the path's length), deflection_m (mean shift across the launch direction), speed_shift,
// speed_shift_sigma (relative), saved_share, saved_share_sigma (of the cost; null where "all terms" was timed
// on another device), verdict ("keep", "leave out", or "not resolved" where the tolerance lies within two
// standard errors). Adds result["tolerance"].
void conclude_terms(nlohmann::json& result);

}  // namespace pf
