// Distance of parcels from the reference after their first collisions.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "lab/gas_case.hpp"

namespace pf {

// Runs elastic parcels from equilibrium for steps.collisions collisions per parcel (by theory), without a
// warm-up. Keys:
// method, area_fraction, restitution, num_parcels, dt, duration, path_error (median over the parcels that
// collided, in diameters), path_low and path_high (its 95 % interval, from order statistics), num_compared.
nlohmann::json measure_path(const GasCase& gas, const GasSteps& steps, std::unique_ptr<Backend> backend);

}  // namespace pf
