#include "cuda/cell_sort.cuh"

#include <algorithm>
#include <cub/device/device_scan.cuh>
#include <utility>

#include "cuda/blocks.cuh"
#include "cuda/check.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;
// Beyond the cells: the one of retired parcels, and the end of its parcels.
constexpr std::uint32_t kExtraStarts = 2;

__global__ void count_kernel(const GridShape grid, const Vec2i* position, std::uint32_t n,
                             const SortKeys keys) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  count_in_cell(grid, keys, i, i < n ? position[i] : Vec2i{}, i < n);
}

__global__ void scatter_kernel(const SortKeys keys, const std::uint32_t* cell_start,
                               const ParcelPointers from, const ParcelPointers to, std::uint32_t n) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= n) return;
  const std::uint32_t key = keys.key[i];
  if (key == kNoCell) return;
  const std::uint32_t place = cell_start[key] + keys.rank[i];
  to.position[place] = from.position[i];
  to.velocity[place] = from.velocity[i];
  to.id[place] = from.id[i];
  if (is_heated(from, i) != 0) set_heated(to, place, 1);
  if (from.tick != nullptr) to.tick[place] = from.tick[i];
  if (from.last_contact_tick != nullptr) to.last_contact_tick[place] = from.last_contact_tick[i];
}

__global__ void update_indices_kernel(const SortKeys keys, const std::uint32_t* cell_start,
                                      std::uint32_t* index, std::uint32_t num) {
  const std::uint32_t k = blockIdx.x * kBlock + threadIdx.x;
  if (k < num) index[k] = cell_start[keys.key[index[k]]] + keys.rank[index[k]];
}

std::size_t num_cell_starts(std::uint32_t capacity) {
  return static_cast<std::size_t>(kDeviceCellsPerParcel * capacity) + 8;
}

std::size_t temporary_bytes(std::size_t num_starts) {
  std::size_t bytes = 0;
  std::uint32_t* none = nullptr;
  PF_CUDA(cub::DeviceScan::ExclusiveSum(nullptr, bytes, none, none, num_starts));
  return std::max<std::size_t>(bytes, 1);
}

}  // namespace

DeviceCellSort::DeviceCellSort(std::uint32_t capacity)
    : counts_(num_cell_starts(capacity)),
      cell_start_(num_cell_starts(capacity)),
      temporary_(temporary_bytes(num_cell_starts(capacity))) {
  constexpr std::uint32_t kAligned = 64;  // ranks start as well aligned as keys
  keys_ = DeviceBuffer<std::uint64_t>((capacity + kAligned - 1) / kAligned * kAligned);
}

std::size_t DeviceCellSort::bytes() const {
  return keys_.bytes() + counts_.bytes() + cell_start_.bytes() + temporary_.bytes();
}

SortKeys DeviceCellSort::keys() const {
  auto* first = reinterpret_cast<std::uint32_t*>(keys_.data());
  return {first, first + keys_.capacity(), counts_.data()};
}

SortKeys DeviceCellSort::begin(const GridShape& grid, cudaStream_t stream) {
  const std::size_t num = grid.num_cells() + kExtraStarts;
  PF_CUDA(cudaMemsetAsync(counts_.data(), 0, num * sizeof(std::uint32_t), stream));
  return keys();
}

void DeviceCellSort::count(const GridShape& grid, const Vec2i* position, std::uint32_t n,
                           cudaStream_t stream) {
  count_kernel<<<blocks_for(n, kBlock), kBlock, 0, stream>>>(grid, position, n, begin(grid, stream));
  PF_LAUNCHED("count_kernel");
}

void DeviceCellSort::sum_counts(const GridShape& grid, cudaStream_t stream) {
  sum_counts_to(cell_start_.data(), grid.num_cells() + kExtraStarts, stream);
}

// The count of a cell is kept one entry later. Summed, that entry is where the cell's parcels begin; after
// one increment per parcel it is the start of the next cell.
std::uint32_t* DeviceCellSort::begin_places(const GridShape& grid, cudaStream_t stream) {
  const std::size_t num = grid.num_cells() + kExtraStarts;
  PF_CUDA(cudaMemsetAsync(counts_.data(), 0, num * sizeof(std::uint32_t), stream));
  return counts_.data() + 1;
}

void DeviceCellSort::sum_to_places(const GridShape& grid, cudaStream_t stream) {
  sum_counts_to(counts_.data(), grid.num_cells() + kExtraStarts, stream);
  std::swap(counts_, cell_start_);
}

void DeviceCellSort::sum_counts_to(std::uint32_t* sums, std::size_t num, cudaStream_t stream) {
  std::size_t bytes = temporary_.bytes();
  PF_CUDA(cub::DeviceScan::ExclusiveSum(temporary_.data(), bytes, counts_.data(), sums, num, stream));
}

void DeviceCellSort::scatter(const ParcelPointers& from, const ParcelPointers& to, std::uint32_t n,
                             cudaStream_t stream) {
  if (n == 0) return;
  PF_CUDA(cudaMemsetAsync(to.heated, 0, DeviceParcels::num_words(n) * sizeof(std::uint32_t), stream));
  scatter_kernel<<<blocks_for(n, kBlock), kBlock, 0, stream>>>(keys(), cell_start_.data(), from, to, n);
  PF_LAUNCHED("scatter_kernel");
}

void DeviceCellSort::update_indices(std::uint32_t* index, std::uint32_t num, cudaStream_t stream) const {
  if (num == 0) return;
  update_indices_kernel<<<blocks_for(num, kBlock), kBlock, 0, stream>>>(keys(), cell_start_.data(), index,
                                                                        num);
  PF_LAUNCHED("update_indices_kernel");
}

}  // namespace pf
