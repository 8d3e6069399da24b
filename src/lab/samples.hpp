// Random numbers for validation.
#pragma once

#include <random>

namespace pf {

// Uniform in [0, 1).
inline double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

}  // namespace pf
