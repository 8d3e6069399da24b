// Flows of a gas of hard discs of unit diameter, mass and speed for study `gas-dynamics`: a shock, a blast, a
// held ball in a stream. Each starts from equilibrium, is stepped by a method, and is measured.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

// Steps of a flow. exact: the step only affects the cost.
struct FlowSteps {
  Method method = Method::exact;
  double displacement =
      0.0;  // of a typical fast parcel per step, diameters; 0: 0.1 collisions per parcel (exact)
  double restitution = 1.0;  // below 1: a gas that loses energy, to see that the checks notice
};

// Two halves of a periodic gas that fly at each other: a shock runs into each of them, as from a wall.
struct ShockCase {
  double area_fraction = 0.01;  // of the undisturbed gas
  double mach = 2.0;
  std::int64_t num_parcels = 100000;
  double half_length = 350.0;  // of the world, in mean free paths (at least diameters) of the undisturbed gas
  std::int64_t seed = 1;
};
// Keys: density, temperature, pressure (ratios), front_speed (over c), their values by theory as *_theory,
// collisions (per parcel), ns_per_disc_time, energy_ratio, max_overlap, num_invalid, and of seed 1 the last
// profile under `profile`.
nlohmann::json measure_shock(const ShockCase& shock, const FlowSteps& steps, Backend& backend);

// A hot disc in a gas at rest.
struct BlastCase {
  double area_fraction = 0.1;
  std::int64_t num_parcels = 100000;
  double num_hot = 100.0;  // parcels of the hot disc
  std::int64_t seed = 1;
};
// Keys: `samples`, a list of [t, radius of the front in the density], lengths over the mean free path, times
// over t of that radius by theory; theory, the prefactor; collisions, ns_per_disc_time, energy_ratio,
// max_overlap.
nlohmann::json measure_blast(const BlastCase& blast, const FlowSteps& steps, Backend& backend);

// A held smooth ball in a stream that starts at once.
struct DragCase {
  double radius_over_path = 1.0;  // ball radius over mean free path
  double speed_ratio = 2.0;       // S
  double area_fraction = 0.0;     // 0: from the number of parcels, at most 0.05; then that follows
  std::int64_t num_parcels = 200000;
  double length = 20.0, height = 14.0;  // of the periodic world, ball radii
  double start = 4.0, end = 8.0;        // of the measurement, ball radii over the stream's speed
  bool contacts = true;                 // among parcels
  std::int64_t seed = 1;
};
// Half of the angle in front of a ball of which the pressure is measured, rad.
inline constexpr double kFrontHalfAngle = 0.2;
// Keys: drag (coefficient, F / (rho V^2 R_c)), hits, start, num_parcels, area_fraction, ball_radius,
// ns_per_disc_time, collisions (per parcel), max_overlap; and of the cell in front of a ball of at least 3
// mean free paths, over the stream's: stagnation_density, stagnation_temperature, stagnation_pressure (by the
// equation of state), and stagnation_anisotropy, the temperature of velocities towards the ball over that of
// those along it.
nlohmann::json measure_drag(const DragCase& drag, const FlowSteps& steps, Backend& backend);

}  // namespace pf
