#include "cuda/blocks.cuh"
#include "cuda/check.cuh"
#include "cuda/domains/kernels.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;

__device__ std::uint32_t thread_index() { return blockIdx.x * kBlock + threadIdx.x; }

// One thread for each of n items. what: for an error's text.
template <class... Parameters, class... Arguments>
void launch(const char* what, void (*kernel)(Parameters...), std::uint32_t n, cudaStream_t stream,
            const Arguments&... arguments) {
  if (n == 0) return;
  kernel<<<blocks_for(n, kBlock), kBlock, 0, stream>>>(arguments...);
  check_cuda(cudaGetLastError(), what, __FILE__, __LINE__);
}

__global__ void drop_kernel(const ParcelPointers parcels, const std::uint32_t* index, std::uint32_t n) {
  const std::uint32_t k = thread_index();
  if (k < n) parcels.id[index[k]] = kDroppedId;
}

__device__ std::int64_t outside_by(std::int64_t x, const Slabs::Span& slab) {
  return max(slab.low - x, x - slab.high);
}

// As Slabs::distance.
__device__ bool is_near(const SlabMargins& slabs, std::int32_t x, unsigned k) {
  if (k == slabs.own) return false;
  const Slabs::Span& slab = slabs.slab[k];
  return min(outside_by(x, slab),
             min(outside_by(x - slabs.extent, slab), outside_by(x + slabs.extent, slab))) <= slabs.margin;
}

__device__ void list_near(const SlabMargins& slabs, const BorderLists& lists, std::int32_t x,
                          std::uint32_t i) {
  const Slabs::Span& own = slabs.slab[slabs.own];
  if (x > own.low + slabs.margin && x < own.high - slabs.margin) return;
  bool is_near_any = false;
  for (unsigned k = 0; k < slabs.num; ++k) {
    if (!is_near(slabs, x, k)) continue;
    atomicAdd(&lists.num_near[k], 1U);
    is_near_any = true;
  }
  if (is_near_any) lists.near.index[atomicAdd(lists.near.count, 1U)] = i;
}

__device__ void list_border(const ParcelPointers& parcels, std::uint32_t i, const SlabMargins& slabs,
                            const BorderLists& lists) {
  if ((parcels.id[i] & kGhostBit) != 0) {
    parcels.id[i] = kDroppedId;
    return;
  }
  const Vec2i position = parcels.position[i];
  if (is_retired(position)) return;
  if (position.x >= lists.inside.low && position.x < lists.inside.high) {
    list_near(slabs, lists, position.x, i);
  } else {
    lists.left.index[atomicAdd(lists.left.count, 1U)] = i;
  }
}

__global__ void find_borders_kernel(const ParcelPointers parcels, std::uint32_t first, std::uint32_t n,
                                    const __grid_constant__ SlabMargins slabs, const BorderLists lists) {
  const std::uint32_t k = thread_index();
  if (k < n) list_border(parcels, first + k, slabs, lists);
}

// A warp for each row.
__global__ void find_borders_in_columns_kernel(const ParcelPointers parcels, const SortedColumns columns,
                                               const __grid_constant__ SlabMargins slabs,
                                               const BorderLists lists) {
  const std::uint32_t row = thread_index() / 32, lane = threadIdx.x % 32;
  const GridShape& grid = columns.grid;
  if (row >= static_cast<std::uint32_t>(grid.y.num)) return;
  const auto num_columns = static_cast<std::uint32_t>(grid.x.num);
  const std::uint32_t* start = columns.cell_start + row * num_columns;
  const auto visit = [&](std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t i = first + lane; i < end; i += 32) list_border(parcels, i, slabs, lists);
  };
  visit(start[0], start[columns.first_inner]);
  visit(start[columns.end_inner], start[num_columns]);
}

__global__ void divide_by_slab_kernel(const ParcelPointers parcels, const std::uint32_t* near,
                                      std::uint32_t n, const __grid_constant__ SlabMargins slabs,
                                      const DividedList divided) {
  const std::uint32_t j = thread_index();
  if (j >= n) return;
  const std::uint32_t i = near[j];
  for (unsigned k = 0; k < slabs.num; ++k) {
    if (is_near(slabs, parcels.position[i].x, k)) divided.index[atomicAdd(&divided.next[k], 1U)] = i;
  }
}

__global__ void gather_kernel(const ParcelPointers parcels, const std::uint32_t* index, std::uint32_t n,
                              Parcel* to) {
  const std::uint32_t k = thread_index();
  if (k >= n) return;
  const std::uint32_t i = index[k];
  to[k] = {parcels.position[i], parcels.velocity[i], parcels.id[i] & kIdBits, is_heated(parcels, i)};
}

__global__ void append_kernel(const Parcel* parcels, std::uint32_t n, std::uint32_t id_bits,
                              std::uint32_t first, const ParcelPointers to) {
  const std::uint32_t i = thread_index();
  if (i >= n) return;
  to.position[first + i] = parcels[i].position;
  to.velocity[first + i] = parcels[i].velocity;
  to.id[first + i] = parcels[i].id | id_bits;
  set_heated(to, first + i, parcels[i].is_heated);
}

__global__ void count_up_kernel(std::uint32_t first, std::uint32_t n, std::uint32_t* index) {
  const std::uint32_t k = thread_index();
  if (k < n) index[k] = first + k;
}

__global__ void count_kept_kernel(const GridShape grid, const ParcelPointers parcels, std::uint32_t first,
                                  std::uint32_t n, const SortKeys keys) {
  const std::uint32_t k = thread_index(), i = first + k;
  const bool is_kept = k < n && parcels.id[i] != kDroppedId;
  count_in_cell(grid, keys, i, is_kept ? parcels.position[i] : Vec2i{}, is_kept);
  if (k < n && !is_kept) keys.key[i] = kNoCell;
}

__global__ void count_pixels_kernel(const ParcelPointers parcels, std::uint32_t n, const World world,
                                    const CountedPicture picture) {
  const std::uint32_t i = thread_index();
  if (i >= n) return;
  const std::uint32_t id = parcels.id[i];
  if ((id & kGhostBit) != 0 || (id & kIdBits) % picture.style.one_in != 0) return;
  const DrawnParcel drawn = drawn_parcel(world, parcels.position[i], parcels.velocity[i]);
  const std::uint32_t pixel = pixel_of(picture.grid, drawn.position_m);
  if (pixel != kNoPixel) atomicAdd(&picture.pixels[pixel], pixel_share(picture.style, drawn.speed_mps));
}

__global__ void find_seen_kernel(const ParcelPointers parcels, std::uint32_t n, const World world,
                                 const PixelGrid grid, const IndexList seen) {
  const std::uint32_t i = thread_index();
  if (i >= n || (parcels.id[i] & kGhostBit) != 0 || is_retired(parcels.position[i])) return;
  if (pixel_of(grid, to_float(to_metres(world, parcels.position[i]))) == kNoPixel) return;
  seen.index[atomicAdd(seen.count, 1U)] = i;
}

__global__ void pack_kernel(const ParcelPointers parcels, const std::uint32_t* index, std::uint32_t n,
                            ParcelMotion* motion) {
  const std::uint32_t k = thread_index();
  if (k >= n) return;
  const std::uint32_t i = index[k];
  motion[k] = {parcels.position[i], parcels.velocity[i], is_heated(parcels, i)};
}

__global__ void unpack_kernel(const ParcelMotion* motion, const std::uint32_t* index, std::uint32_t n,
                              const ParcelPointers parcels) {
  const std::uint32_t k = thread_index();
  if (k >= n) return;
  parcels.position[index[k]] = motion[k].position;
  parcels.velocity[index[k]] = motion[k].velocity;
  set_heated(parcels, index[k], motion[k].is_heated);
}

}  // namespace

void launch_drop(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t n,
                 cudaStream_t stream) {
  launch("launch of drop_kernel", drop_kernel, n, stream, parcels, index, n);
}

void launch_find_borders(const ParcelPointers& parcels, std::uint32_t first, std::uint32_t n,
                         const SlabMargins& slabs, const BorderLists& lists, cudaStream_t stream) {
  launch("launch of find_borders_kernel", find_borders_kernel, n, stream, parcels, first, n, slabs, lists);
}

void launch_find_borders_in_columns(const ParcelPointers& parcels, const SortedColumns& columns,
                                    const SlabMargins& slabs, const BorderLists& lists, cudaStream_t stream) {
  launch("launch of find_borders_in_columns_kernel", find_borders_in_columns_kernel,
         static_cast<std::uint32_t>(columns.grid.y.num) * 32, stream, parcels, columns, slabs, lists);
}

void launch_divide_by_slab(const ParcelPointers& parcels, const std::uint32_t* near, std::uint32_t n,
                           const SlabMargins& slabs, const DividedList& divided, cudaStream_t stream) {
  launch("launch of divide_by_slab_kernel", divide_by_slab_kernel, n, stream, parcels, near, n, slabs,
         divided);
}

void launch_gather(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t n, Parcel* to,
                   cudaStream_t stream) {
  launch("launch of gather_kernel", gather_kernel, n, stream, parcels, index, n, to);
}

void launch_append(const Parcel* parcels, std::uint32_t n, std::uint32_t id_bits, std::uint32_t first,
                   const ParcelPointers& to, cudaStream_t stream) {
  launch("launch of append_kernel", append_kernel, n, stream, parcels, n, id_bits, first, to);
}

void launch_count_up(std::uint32_t first, std::uint32_t n, std::uint32_t* index, cudaStream_t stream) {
  launch("launch of count_up_kernel", count_up_kernel, n, stream, first, n, index);
}

void launch_count_kept(const GridShape& grid, const ParcelPointers& parcels, std::uint32_t first,
                       std::uint32_t n, const SortKeys& keys, cudaStream_t stream) {
  launch("launch of count_kept_kernel", count_kept_kernel, n, stream, grid, parcels, first, n, keys);
}

void launch_count_pixels(const ParcelPointers& parcels, std::uint32_t n, const World& world,
                         const CountedPicture& picture, cudaStream_t stream) {
  launch("launch of count_pixels_kernel", count_pixels_kernel, n, stream, parcels, n, world, picture);
}

void launch_find_seen(const ParcelPointers& parcels, std::uint32_t n, const World& world,
                      const PixelGrid& grid, const IndexList& seen, cudaStream_t stream) {
  PF_CUDA(cudaMemsetAsync(seen.count, 0, sizeof(std::uint32_t), stream));
  launch("launch of find_seen_kernel", find_seen_kernel, n, stream, parcels, n, world, grid, seen);
}

void launch_pack(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t n,
                 ParcelMotion* motion, cudaStream_t stream) {
  launch("launch of pack_kernel", pack_kernel, n, stream, parcels, index, n, motion);
}

void launch_unpack(const ParcelMotion* motion, const std::uint32_t* index, std::uint32_t n,
                   const ParcelPointers& parcels, cudaStream_t stream) {
  launch("launch of unpack_kernel", unpack_kernel, n, stream, motion, index, n, parcels);
}

}  // namespace pf
