// The profile of the parcels, summed on the device.
#pragma once

#include "backend/profile.hpp"
#include "cuda/parcel_arrays.cuh"

namespace pf {

// Adds the parcels that are neither ghosts nor retired, as the function of the same name for the host does,
// to the same bits. Waits for the stream.
void add_parcels(Profile& profile, const ParcelPointers& parcels, std::uint32_t num_parcels,
                 cudaStream_t stream);

}  // namespace pf
