// Contact law of method `spring` from contact duration t_c and restitution e of a pair of equal masses:
// e = exp(-g t_c), (pi / t_c)^2 = w0^2 - g^2 with w0^2 = 2 k / m and g = gamma / m (docs/physics.md, 'Spring
// contact').
#pragma once

#include <cmath>

#include "core/portable_math.hpp"

namespace pf {

struct SpringContactRates {
  double omega0_squared_per_s2 = 0.0;  // w0^2 = 2 k / m
  double damping_per_s = 0.0;          // g = gamma / m
};

// restitution in [0, 1], taken as at least 1e-3; contact_s > 0.
inline SpringContactRates spring_contact_rates(double restitution, double contact_s) {
  const double damping = -natural_log(std::fmax(restitution, 1e-3)) / contact_s;
  const double frequency = kPi / contact_s;
  return {frequency * frequency + damping * damping, damping};
}

// Longest stable step of a pair in contact. With x the overlap and v its rate, a step is
// v' = (1 - 2 g dt) v - w0^2 dt x, x' = x + dt v'. Its eigenvalues stay within the unit circle as long as
// w0^2 dt^2 + 4 g dt <= 4. For e = 1 this is dt <= 2 / w0.
inline double spring_step_limit_s(const SpringContactRates& rates) {
  const double g = rates.damping_per_s;
  return 2.0 * (std::sqrt(g * g + rates.omega0_squared_per_s2) - g) / rates.omega0_squared_per_s2;
}

}  // namespace pf
