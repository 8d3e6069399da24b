// Kernels beside the steps: spawning, drawing without a step, conserved quantities, the state hash,
// snapshots.
#pragma once

#include "backend/draw_buffers.hpp"
#include "cuda/parcel_arrays.cuh"
#include "model/spawn.hpp"

namespace pf {

// cudaSuccess if the program has code for the current device, else the reason.
cudaError_t find_kernel_image();

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

// Sums over a block of kMeasureBlock parcels. The host adds them up in order, so that the result repeats.
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
