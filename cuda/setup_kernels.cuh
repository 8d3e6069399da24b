// Kernels beside the steps: spawning, drawing without a step, conserved quantities, the state hash,
// snapshots.
#pragma once

#include "backend/draw_buffers.hpp"
#include "cuda/parcel_arrays.cuh"
#include "model/measures.hpp"
#include "model/spawn.hpp"

namespace pf {

// cudaSuccess if the program has code for the current device, else the reason.
cudaError_t find_kernel_image();

// Virtual architecture that the code in use on the current device was compiled for, as 90 for 9.0.
int version_of_code();

// plan: its tables are in device memory.
void launch_spawn(const SpawnPlan& plan, std::uint64_t num_free_sites, const ParcelPointers& to,
                  cudaStream_t stream);

void launch_draw(const World& world, const ParcelPointers& parcels, std::uint32_t num_parcels,
                 const DrawBuffers& draw, cudaStream_t stream);

// position[id] and velocity[id] of every parcel, num_parcels entries each.
void launch_scatter_by_id(const ParcelPointers& parcels, std::uint32_t num_parcels, Vec2i* position,
                          Vec2f* velocity, cudaStream_t stream);
// id[i] = i.
void launch_number(std::uint32_t* id, std::uint32_t num_parcels, cudaStream_t stream);

// Sums over the parcels that are no ghosts. mass_kg: of each. Waits for the stream.
ParcelSums sum_parcels(const ParcelPointers& parcels, std::uint32_t num_parcels, double mass_kg,
                       cudaStream_t stream);

}  // namespace pf
