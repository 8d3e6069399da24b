#include "cuda/check.cuh"
#include "cuda/domains/kernels.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;

unsigned blocks_for(std::uint32_t n) { return (n + kBlock - 1) / kBlock; }

__device__ std::uint32_t thread_index() { return blockIdx.x * kBlock + threadIdx.x; }

__device__ void add_to(const ParcelList& list, const ParcelPointers& parcels, std::uint32_t i) {
  const std::uint32_t k = atomicAdd(list.count, 1U);
  list.parcels.position[k] = parcels.position[i];
  list.parcels.velocity[k] = parcels.velocity[i];
  list.parcels.id[k] = parcels.id[i];
  if (list.index != nullptr) list.index[k] = i;
}

__global__ void release_kernel(const ParcelPointers parcels, std::uint32_t n, const SlabRange slab,
                               const ParcelList left) {
  const std::uint32_t i = thread_index();
  if (i >= n) return;
  if ((parcels.id[i] & kCopyBit) == 0) {
    const Vec2i position = parcels.position[i];
    if (is_retired(position) || (position.x >= slab.first && position.x < slab.end)) return;
    add_to(left, parcels, i);
  }
  parcels.id[i] = kDroppedId;
}

__global__ void find_margins_kernel(const ParcelPointers parcels, std::uint32_t n, const SlabRange inner,
                                    const ParcelList near) {
  const std::uint32_t i = thread_index();
  if (i >= n || parcels.id[i] == kDroppedId) return;
  const Vec2i position = parcels.position[i];
  if ((position.x > inner.first && position.x < inner.end) || is_retired(position)) return;
  add_to(near, parcels, i);
}

__global__ void append_kernel(const Parcel* parcels, std::uint32_t n, std::uint32_t id_bits,
                              std::uint32_t first, const ParcelPointers to) {
  const std::uint32_t i = thread_index();
  if (i >= n) return;
  to.position[first + i] = parcels[i].position;
  to.velocity[first + i] = parcels[i].velocity;
  to.id[first + i] = parcels[i].id | id_bits;
}

__global__ void count_kept_kernel(const GridShape grid, const ParcelPointers parcels, std::uint32_t n,
                                  const SortKeys keys) {
  const std::uint32_t i = thread_index();
  const bool is_kept = i < n && parcels.id[i] != kDroppedId;
  count_in_cell(grid, keys, i, is_kept ? parcels.position[i] : Vec2i{}, is_kept);
  if (i < n && !is_kept) keys.key[i] = kNoCell;
}

__global__ void pack_kernel(const ParcelPointers parcels, const std::uint32_t* index, std::uint32_t n,
                            ParcelMotion* motion) {
  const std::uint32_t k = thread_index();
  if (k < n) motion[k] = {parcels.position[index[k]], parcels.velocity[index[k]]};
}

__global__ void unpack_kernel(const ParcelMotion* motion, const std::uint32_t* index, std::uint32_t n,
                              const ParcelPointers parcels) {
  const std::uint32_t k = thread_index();
  if (k >= n) return;
  parcels.position[index[k]] = motion[k].position;
  parcels.velocity[index[k]] = motion[k].velocity;
}

}  // namespace

void launch_release(const ParcelPointers& parcels, std::uint32_t n, const SlabRange& slab,
                    const ParcelList& left, cudaStream_t stream) {
  PF_CUDA(cudaMemsetAsync(left.count, 0, sizeof(std::uint32_t), stream));
  if (n == 0) return;
  release_kernel<<<blocks_for(n), kBlock, 0, stream>>>(parcels, n, slab, left);
  PF_LAUNCHED("release_kernel");
}

void launch_find_margins(const ParcelPointers& parcels, std::uint32_t n, const SlabRange& inner,
                         const ParcelList& near, cudaStream_t stream) {
  PF_CUDA(cudaMemsetAsync(near.count, 0, sizeof(std::uint32_t), stream));
  if (n == 0) return;
  find_margins_kernel<<<blocks_for(n), kBlock, 0, stream>>>(parcels, n, inner, near);
  PF_LAUNCHED("find_margins_kernel");
}

void launch_append(const Parcel* parcels, std::uint32_t n, std::uint32_t id_bits, std::uint32_t first,
                   const ParcelPointers& to, cudaStream_t stream) {
  if (n == 0) return;
  append_kernel<<<blocks_for(n), kBlock, 0, stream>>>(parcels, n, id_bits, first, to);
  PF_LAUNCHED("append_kernel");
}

void launch_count_kept(const GridShape& grid, const ParcelPointers& parcels, std::uint32_t n,
                       const SortKeys& keys, cudaStream_t stream) {
  if (n == 0) return;
  count_kept_kernel<<<blocks_for(n), kBlock, 0, stream>>>(grid, parcels, n, keys);
  PF_LAUNCHED("count_kept_kernel");
}

void launch_pack(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t n,
                 ParcelMotion* motion, cudaStream_t stream) {
  if (n == 0) return;
  pack_kernel<<<blocks_for(n), kBlock, 0, stream>>>(parcels, index, n, motion);
  PF_LAUNCHED("pack_kernel");
}

void launch_unpack(const ParcelMotion* motion, const std::uint32_t* index, std::uint32_t n,
                   const ParcelPointers& parcels, cudaStream_t stream) {
  if (n == 0) return;
  unpack_kernel<<<blocks_for(n), kBlock, 0, stream>>>(motion, index, n, parcels);
  PF_LAUNCHED("unpack_kernel");
}

}  // namespace pf
