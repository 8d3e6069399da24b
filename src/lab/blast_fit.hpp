// Fits of a blast's radius over time.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// samples: rows of measure_blast(), [time, radius of the front]. Both fits take those whose
// radius is at least 0.4 of the last.

// p of R = A t^p.
double blast_exponent(const nlohmann::json& samples);
// Slope of R over the square root of time: the prefactor over that of theory. A constant distance between the
// place where the front is found and its ideal place does not matter.
double blast_slope(const nlohmann::json& samples);

}  // namespace pf
