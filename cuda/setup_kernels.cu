#include "cuda/setup_kernels.cuh"

#include "cuda/check.cuh"
#include "cuda/draw_parcel.cuh"
#include "model/measures.hpp"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;

unsigned blocks_for(std::uint32_t n) { return (n + kBlock - 1) / kBlock; }

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
    const std::uint32_t i = first + k;
    const Vec2f velocity = parcels.velocity[i];
    const Vec2d v = to_double(velocity);
    sum.speed2 += dot(v, v);
    sum.velocity_x += v.x;
    sum.velocity_y += v.y;
    sum.speed += sqrt(dot(v, v));
    sum.num_live += is_retired(parcels.position[i]) ? 0 : 1;
    sum.hash += parcel_hash(parcels.id[i], parcels.position[i], velocity);
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

void launch_spawn(const SpawnPlan& plan, std::uint64_t num_free_sites, const ParcelPointers& to,
                  cudaStream_t stream) {
  if (plan.num_parcels == 0) return;
  spawn_kernel<<<blocks_for(plan.num_parcels), kBlock, 0, stream>>>(plan, num_free_sites, to);
  PF_LAUNCHED("spawn_kernel");
}

void launch_draw(const World& world, const ParcelPointers& parcels, std::uint32_t n, const DrawBuffers& draw,
                 cudaStream_t stream) {
  if (n == 0) return;
  draw_kernel<<<blocks_for(n), kBlock, 0, stream>>>(world, parcels, n, draw);
  PF_LAUNCHED("draw_kernel");
}

void launch_scatter_by_id(const ParcelPointers& parcels, std::uint32_t n, Vec2i* position, Vec2f* velocity,
                          cudaStream_t stream) {
  if (n == 0) return;
  scatter_by_id_kernel<<<blocks_for(n), kBlock, 0, stream>>>(parcels, n, position, velocity);
  PF_LAUNCHED("scatter_by_id_kernel");
}

void launch_number(std::uint32_t* id, std::uint32_t n, cudaStream_t stream) {
  if (n == 0) return;
  number_kernel<<<blocks_for(n), kBlock, 0, stream>>>(id, n);
  PF_LAUNCHED("number_kernel");
}

void launch_measure(const ParcelPointers& parcels, std::uint32_t n, MeasurePart* parts, cudaStream_t stream) {
  if (n == 0) return;
  measure_kernel<<<(n + kMeasureBlock - 1) / kMeasureBlock, kBlock, 0, stream>>>(parcels, n, parts);
  PF_LAUNCHED("measure_kernel");
}

}  // namespace pf
