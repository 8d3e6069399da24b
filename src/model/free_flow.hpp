// Free-molecular flow past a disc: a ball in a stream of parcels that do not touch each other (Schaaf and
// Chambre 1961; docs/physics.md, 'Drag on the ball'). S, the speed ratio, is the stream's speed V over
// sqrt(2) c, with c = sqrt(kT/m) the parcels' thermal speed per component; R_c = R + r is the distance of
// centres at a contact, rho the parcels' mass per area and n their number.
#pragma once

#include <cmath>

#include "core/portable_math.hpp"

namespace pf {

// exp(-x) I_n(x), n = 0 or 1. Beyond x = 300, where I_n nears the end of the double range, the asymptotic
// series (Abramowitz and Stegun 9.7.1) replaces it: its first dropped term is below 1e-11 there.
inline double scaled_bessel_i(int n, double x) {
  if (x <= 300.0) return std::exp(-x) * std::cyl_bessel_i(n, x);
  const double mu = 4.0 * n * n;
  double term = 1.0, sum = 1.0;
  for (int k = 1; k <= 4; ++k) {
    const double odd = 2.0 * k - 1.0;
    term *= -(mu - odd * odd) / (k * 8.0 * x);
    sum += term;
  }
  return sum / std::sqrt(2.0 * kPi * x);
}

// Drag coefficient, F / (rho V^2 R_c), of the incident momentum: two thirds are of its normal part, one third
// of its tangential part.
inline double incident_momentum_drag(double speed_ratio) {
  const double s = speed_ratio, x = 0.5 * s * s;
  const double bessel = (s * s + 1.5) * scaled_bessel_i(0, x) + (s * s + 0.5) * scaled_bessel_i(1, x);
  return std::sqrt(kPi) / s * bessel;
}

// Drag coefficient of a smooth ball far heavier than a parcel.
inline double smooth_drag(double speed_ratio, double restitution) {
  return (1.0 + restitution) * (2.0 / 3.0) * incident_momentum_drag(speed_ratio);
}

// The force that a drag coefficient stands for. kg_per_m2: rho; contact_m: R_c.
inline double drag_force_n(double coefficient, double kg_per_m2, double speed_mps, double contact_m) {
  return coefficient * kg_per_m2 * speed_mps * speed_mps * contact_m;
}

// Hits per second over 2 R_c n V.
inline double free_flow_hits(double speed_ratio) {
  const double s = speed_ratio, x = 0.5 * s * s;
  return 0.5 * std::sqrt(kPi) / s * ((1.0 + s * s) * scaled_bessel_i(0, x) + s * s * scaled_bessel_i(1, x));
}

// Hits per second at a speed V of the stream. contact_m: R_c. num_per_m2: n.
inline double free_flow_hits_per_s(double contact_m, double num_per_m2, double speed_mps,
                                   double speed_ratio) {
  return 2.0 * contact_m * num_per_m2 * speed_mps * free_flow_hits(speed_ratio);
}

// Relative standard error of the drag on a smooth ball after so many hits that are independent of each other:
// the root of R / num_hits with R = <J^2> / <J>^2 of the impulses J along the stream. R is 6/5 in a cold
// stream; the rest is fitted to quadratures at S = 0.3 to 10, within 1 % of R.
inline double smooth_drag_error(double speed_ratio, double num_hits) {
  const double s2 = speed_ratio * speed_ratio;
  return std::sqrt((1.2 + (0.49 + 0.26 * s2 * s2 / (s2 * s2 + 26.0)) / s2) / num_hits);
}

}  // namespace pf
