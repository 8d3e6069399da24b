#include "cuda/cell_sort.cuh"

#include <algorithm>
#include <cub/device/device_radix_sort.cuh>

#include "cuda/check.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;

struct CellStarts {
  std::uint32_t* start;  // num_keys + 1 entries
  std::uint32_t num_keys;
};

__global__ void key_kernel(const GridShape grid, const Vec2i* position, std::uint32_t n,
                           const SortKeys keys) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= n) return;
  keys.key[i] = cell_key(grid, position[i]);
  keys.index[i] = i;
}

// Copies parcel i of the new order. The first parcel of each cell writes the start of that cell and of the
// empty cells before it; the last parcel those of the cells after it.
__global__ void gather_kernel(const SortKeys sorted, const ParcelPointers from, const ParcelPointers to,
                              std::uint32_t n, const CellStarts cells) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= n) return;
  const std::uint32_t source = sorted.index[i];
  to.position[i] = from.position[source];
  to.velocity[i] = from.velocity[source];
  to.id[i] = from.id[source];
  if (from.tick != nullptr) to.tick[i] = from.tick[source];
  if (from.last_contact_tick != nullptr) to.last_contact_tick[i] = from.last_contact_tick[source];
  const std::uint32_t key = sorted.key[i];
  const std::uint32_t first = i == 0 ? 0 : sorted.key[i - 1] + 1;
  for (std::uint32_t cell = first; cell <= key; ++cell) cells.start[cell] = i;
  if (i + 1 == n) {
    for (std::uint32_t cell = key + 1; cell <= cells.num_keys; ++cell) cells.start[cell] = n;
  }
}

// Bits of the largest key.
int bits_of(std::uint32_t largest) {
  int bits = 1;
  while (bits < 32 && (largest >> bits) != 0) ++bits;
  return bits;
}

std::size_t temporary_bytes(std::uint32_t n) {
  std::size_t bytes = 0;
  cub::DoubleBuffer<std::uint32_t> keys(nullptr, nullptr), values(nullptr, nullptr);
  PF_CUDA(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, values, n, 0, 32));
  return std::max<std::size_t>(bytes, 1);
}

std::size_t num_cell_starts(std::uint32_t capacity) {
  return static_cast<std::size_t>(kDeviceCellsPerParcel * capacity) + 8;
}

unsigned blocks_for(std::uint32_t n) { return (n + kBlock - 1) / kBlock; }

}  // namespace

DeviceCellSort::DeviceCellSort(std::uint32_t capacity)
    : cell_start_(num_cell_starts(capacity)), temporary_(temporary_bytes(capacity)) {
  constexpr std::uint32_t kAligned = 64;  // the second array of keys starts as well aligned as the first
  keys_ = DeviceBuffer<std::uint64_t>((capacity + kAligned - 1) / kAligned * kAligned);
  for (DeviceBuffer<std::uint32_t>& indices : indices_) indices = DeviceBuffer<std::uint32_t>(capacity);
}

std::size_t DeviceCellSort::bytes() const {
  return keys_.bytes() + 2 * indices_[0].bytes() + cell_start_.bytes() + temporary_.bytes();
}

void DeviceCellSort::write_keys(const GridShape& grid, const Vec2i* position, std::uint32_t n,
                                cudaStream_t stream) {
  key_kernel<<<blocks_for(n), kBlock, 0, stream>>>(grid, position, n, keys_to_write());
  PF_LAUNCHED("key_kernel");
}

void DeviceCellSort::sort_keys(const GridShape& grid, std::uint32_t n, cudaStream_t stream) {
  cub::DoubleBuffer<std::uint32_t> key_arrays(keys(0), keys(1));
  cub::DoubleBuffer<std::uint32_t> indices(indices_[0].data(), indices_[1].data());
  std::size_t bytes = temporary_.bytes();
  PF_CUDA(cub::DeviceRadixSort::SortPairs(temporary_.data(), bytes, key_arrays, indices, n, 0,
                                          bits_of(grid.num_cells()), stream));
  sorted_ = key_arrays.selector;
}

void DeviceCellSort::gather(const GridShape& grid, const ParcelPointers& from, const ParcelPointers& to,
                            std::uint32_t n, cudaStream_t stream) {
  const SortKeys sorted{keys(sorted_), indices_[sorted_].data()};
  gather_kernel<<<blocks_for(n), kBlock, 0, stream>>>(sorted, from, to, n,
                                                      {cell_start_.data(), grid.num_cells() + 1});
  PF_LAUNCHED("gather_kernel");
}

double DeviceCellSort::min_bytes_per_parcel(const GridShape& grid) {
  const int passes = (bits_of(grid.num_cells()) + 7) / 8;
  return 8.0 + 16.0 * passes + 8.0;
}

}  // namespace pf
