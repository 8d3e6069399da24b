#include "cuda/setup_kernels.cuh"

#include <vector>

#include "backend/draw_buffers.hpp"
#include "cuda/blocks.cuh"
#include "cuda/check.cuh"
#include "cuda/device_buffer.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;

__global__ void spawn_kernel(const SpawnPlan plan, std::uint64_t num_free_sites, const ParcelPointers to) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= plan.num_parcels) return;
  const Parcel parcel = spawn_parcel(plan, num_free_sites, i);
  to.position[i] = parcel.position;
  to.velocity[i] = parcel.velocity;
  to.id[i] = parcel.id;
}

__global__ void draw_kernel(const World world, const ParcelPointers parcels, std::uint32_t n,
                            const DrawBuffers draw) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= n) return;
  draw_parcel(draw, world, i, parcels.position[i], parcels.velocity[i]);
}

__global__ void scatter_by_id_kernel(const ParcelPointers parcels, std::uint32_t n, Vec2i* position,
                                     Vec2f* velocity) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= n) return;
  position[parcels.id[i]] = parcels.position[i];
  velocity[parcels.id[i]] = parcels.velocity[i];
}

__global__ void number_kernel(std::uint32_t* id, std::uint32_t n) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i < n) id[i] = i;
}

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

__device__ void add_part(MeasurePart& to, const MeasurePart& o) {
  to.speed2 += o.speed2;
  to.velocity_x += o.velocity_x;
  to.velocity_y += o.velocity_y;
  to.speed += o.speed;
  to.num_live += o.num_live;
  to.hash += o.hash;
}

__global__ void measure_kernel(const ParcelPointers parcels, std::uint32_t n, MeasurePart* parts) {
  __shared__ MeasurePart shared[kBlock];
  MeasurePart sum;
  const std::uint32_t first = blockIdx.x * kMeasureBlock;
  for (std::uint32_t k = threadIdx.x; k < kMeasureBlock && first + k < n; k += kBlock) {
    const std::uint32_t i = first + k, id = parcels.id[i];
    if ((id & kGhostBit) != 0) continue;
    const Vec2f velocity = parcels.velocity[i];
    const Vec2d v = to_double(velocity);
    sum.speed2 += dot(v, v);
    sum.velocity_x += v.x;
    sum.velocity_y += v.y;
    sum.speed += sqrt(dot(v, v));
    sum.num_live += is_retired(parcels.position[i]) ? 0 : 1;
    sum.hash += parcel_hash(id, parcels.position[i], velocity);
  }
  shared[threadIdx.x] = sum;
  for (unsigned half = kBlock / 2; half > 0; half /= 2) {
    __syncthreads();
    if (threadIdx.x < half) add_part(shared[threadIdx.x], shared[threadIdx.x + half]);
  }
  if (threadIdx.x == 0) parts[blockIdx.x] = shared[0];
}

}  // namespace

cudaError_t find_kernel_image() {
  cudaFuncAttributes ignored{};
  return cudaFuncGetAttributes(&ignored, number_kernel);
}

int version_of_code() {
  cudaFuncAttributes attributes{};
  PF_CUDA(cudaFuncGetAttributes(&attributes, number_kernel));
  return attributes.ptxVersion;
}

void launch_spawn(const SpawnPlan& plan, std::uint64_t num_free_sites, const ParcelPointers& to,
                  cudaStream_t stream) {
  if (plan.num_parcels == 0) return;
  spawn_kernel<<<blocks_for(plan.num_parcels, kBlock), kBlock, 0, stream>>>(plan, num_free_sites, to);
  PF_LAUNCHED("spawn_kernel");
}

void launch_draw(const World& world, const ParcelPointers& parcels, std::uint32_t n, const DrawBuffers& draw,
                 cudaStream_t stream) {
  if (n == 0) return;
  draw_kernel<<<blocks_for(n, kBlock), kBlock, 0, stream>>>(world, parcels, n, draw);
  PF_LAUNCHED("draw_kernel");
}

void launch_scatter_by_id(const ParcelPointers& parcels, std::uint32_t n, Vec2i* position, Vec2f* velocity,
                          cudaStream_t stream) {
  if (n == 0) return;
  scatter_by_id_kernel<<<blocks_for(n, kBlock), kBlock, 0, stream>>>(parcels, n, position, velocity);
  PF_LAUNCHED("scatter_by_id_kernel");
}

void launch_number(std::uint32_t* id, std::uint32_t n, cudaStream_t stream) {
  if (n == 0) return;
  number_kernel<<<blocks_for(n, kBlock), kBlock, 0, stream>>>(id, n);
  PF_LAUNCHED("number_kernel");
}

ParcelSums sum_parcels(const ParcelPointers& parcels, std::uint32_t n, double mass_kg, cudaStream_t stream) {
  ParcelSums sums;
  if (n == 0) return sums;
  std::vector<MeasurePart> parts(blocks_for(n, kMeasureBlock));
  const DeviceBuffer<MeasurePart> on_device(parts.size());
  measure_kernel<<<static_cast<unsigned>(parts.size()), kBlock, 0, stream>>>(parcels, n, on_device.data());
  PF_LAUNCHED("measure_kernel");
  PF_CUDA(cudaMemcpyAsync(parts.data(), on_device.data(), parts.size() * sizeof(MeasurePart),
                          cudaMemcpyDeviceToHost, stream));
  PF_CUDA(cudaStreamSynchronize(stream));
  for (const MeasurePart& part : parts) {
    sums.measures += {.parcel_energy_j = 0.5 * mass_kg * part.speed2,
                      .momentum_kg_mps = Vec2d{part.velocity_x, part.velocity_y} * mass_kg,
                      .momentum_scale_kg_mps = mass_kg * part.speed,
                      .num_live = part.num_live};
    sums.hash += part.hash;
  }
  return sums;
}

}  // namespace pf
