// A gas of hard discs of unit diameter, mass and speed for the studies, times in d/c. It starts from
// equilibrium, is stepped by a method, and is measured.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "backend/backend.hpp"
#include "model/methods.hpp"
#include "scene/settings.hpp"

namespace pf {

struct GasCase {
  std::int64_t num_parcels = 4000;
  double area_fraction = 0.2;  // up to 0.69
  double restitution = 1.0;
  std::int64_t seed = 1;
  Boundary boundary = Boundary::periodic;
};

constexpr int kGasBlocks = 16;  // of a measurement; the statistical error follows from their scatter

// Steps of a run. Times in d/c.
struct GasSteps {
  Method method = Method::impulse;
  double dt = 0.0;
  double spring_contact = 0.0;  // contact duration of `spring`; 0: 20 steps
  double contact_clock = 0.0;   // contact duration of the TC model, of `exact`; 0: none
  double collisions = 40.0;     // length: collisions per parcel by theory, at the starting temperature
  double warmup = 1.0;          // collisions per parcel before the measurement
};

Settings gas_settings(const GasCase& gas);

// The case in equilibrium: spawned, then 20 collisions per parcel by `exact` with restitution 1. The result
// is cached: cases that differ in restitution only share it. Thread-safe.
const ParcelSnapshot& equilibrated(const GasCase& gas);

// A backend that holds the case in equilibrium.
struct GasRun {
  GasRun(const GasCase& gas, const GasSteps& with, std::unique_ptr<Backend> empty);
  StepReport advance(std::uint32_t num_steps);
  double c2() const;  // temperature: mean square speed per component at zero total momentum

  GasSteps steps;
  Settings settings;
  Physics physics;
  std::unique_ptr<Backend> backend;
};

// Collisions per parcel and time by theory, at temperature 1.
double theory_rate(double area_fraction);

// Runs and measures. Keys: method, area_fraction, restitution, num_parcels, dt, displacement_per_step,
// collisions (per parcel), duration, ns_per_disc_time (best block), rate (per parcel, time and c),
// rate_sigma, compressibility, compressibility_sigma (standard errors), energy_ratio (end over start),
// max_overlap, num_invalid. JSON writes NaN as null.
nlohmann::json measure_gas(const GasCase& gas, const GasSteps& wanted, std::unique_ptr<Backend> backend);

}  // namespace pf
