// Kernels around the steps: spawning, drawing without stepping, conserved quantities, the state hash,
// snapshots.
#pragma once

#include "backend/backend.hpp"
#include "cuda/device_buffer.cuh"
#include "model/spawn.hpp"
#include "cuda/time_step/state.cuh"

namespace pf {

// Whether the program has code for the current device: cudaSuccess, or why not.
cudaError_t find_kernel_image();

// plan's tables must be device pointers.
void launch_spawn(const SpawnPlan& plan, std::uint64_t num_free_sites, const ParcelPointers& to,
                  cudaStream_t stream);

void launch_draw(const World& world, const ParcelPointers& parcels, std::uint32_t num_parcels,
                 const DrawBuffers& draw, cudaStream_t stream);

// out[id] = parcel; position and velocity with num_parcels entries each. And the reverse, with ids 0 .. n
// - 1.
void launch_scatter_by_id(const ParcelPointers& parcels, std::uint32_t num_parcels, Vec2i* position,
                          Vec2f* velocity, cudaStream_t stream);
void launch_number(std::uint32_t* id, std::uint32_t num_parcels, cudaStream_t stream);

// Per block of kMeasureBlock parcels; to be added up on the host in order, so that the result repeats.
struct MeasurePart {
  double speed2 = 0.0;  // sum of v^2
  double velocity_x = 0.0;
  double velocity_y = 0.0;
  double speed = 0.0;  // sum of |v|
  unsigned long long num_live = 0;
  unsigned long long hash = 0;
};
constexpr unsigned kMeasureBlock = 4096;

void launch_measure(const ParcelPointers& parcels, std::uint32_t num_parcels, MeasurePart* parts,
                    cudaStream_t stream);

}  // namespace pf
