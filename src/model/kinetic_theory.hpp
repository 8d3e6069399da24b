// Kinetic theory of a gas of hard discs: its collision rate, and the share of collisions that steps miss.
#pragma once

#include <cmath>

#include "core/portable_math.hpp"
#include "model/physics.hpp"

namespace pf {

// Area fraction N pi r^2 / area.
inline double area_fraction_of(const Physics& physics) {
  const ParcelConstants& parcels = physics.parcels;
  return parcels.num * kPi * parcels.radius_m * parcels.radius_m / area_m2(physics.world);
}

// Contact value of the pair distribution of hard discs, Henderson 1975: within 0.03 % at area fraction 0.3.
inline double contact_value(double area_fraction) {
  const double free = 1.0 - area_fraction;
  return (1.0 - 7.0 * area_fraction / 16.0) / (free * free);
}

// Collisions per parcel and second after Enskog: 4 eta chi c / (sqrt(pi) r), c = sqrt(kT/m) the speed per
// component (docs/physics.md, 'Collision rate').
inline double enskog_rate_per_s(double area_fraction, double speed_mps, double radius_m) {
  return 4.0 * area_fraction * contact_value(area_fraction) / std::sqrt(kPi) * speed_mps / radius_m;
}

// Z = 1 + (sum over collisions of sigma |J|) / (2 N kT t) of a run, the virial pressure over that of an ideal
// gas (docs/physics.md, 'Pressure'). impulse_sum_mps: sum of |J| / m over the collisions of time_s. num:
// number of parcels. c2_m2ps2: temperature c^2 = kT / m, at zero total momentum energy / (m (N - 1)).
inline double measured_compressibility(double impulse_sum_mps, double time_s, double num, double c2_m2ps2,
                                       double diameter_m) {
  return 1.0 + diameter_m * impulse_sum_mps / (2.0 * num * c2_m2ps2 * time_s);
}

// Share of collisions that a pair misses if its relative displacement per step is Delta = step_diameters, in
// contact distances. It is the mean over impact parameters b in [0, d] of max(0, 1 - chord / Delta) with
// chord = 2 sqrt(d^2 - b^2), because the phase of the steps is uniform. For Delta < 2 d only chords below
// Delta can be missed. The share is Delta^2 / 24 for small Delta and 1 - pi / (2 Delta) from Delta = 2 on.
inline double missed_fraction(double step_diameters) {
  if (step_diameters >= 2.0) return 1.0 - kPi / (2.0 * step_diameters);
  if (step_diameters < 1e-3) return step_diameters * step_diameters / 24.0;
  const double phi = std::asin(0.5 * step_diameters);
  return 1.0 - 0.5 * std::cos(phi) - 0.5 * phi / std::sin(phi);
}

// Share of collisions that a gas misses in steps of dt_s. Colliding pairs approach with a mean square
// relative speed of 6 c^2 (two dimensions, weighted by that speed).
inline double missed_fraction_of_gas(double speed_mps, double dt_s, double diameter_m) {
  return missed_fraction(std::sqrt(6.0) * speed_mps * dt_s / diameter_m);
}

}  // namespace pf
