// Sorts the parcels by cell, by counting: kernels that know the cells of the parcels count them, CUB sums the
// counts to the starts of the cells, and a scatter puts each parcel in its place. Positions change little
// from sort to sort, so that neighbours write near each other. The order within a cell is any.
#pragma once

#include "cuda/parcel_arrays.cuh"
#include "model/grid.hpp"

namespace pf {

// Key of parcels that a sort leaves out.
constexpr std::uint32_t kNoCell = UINT32_MAX;

// Input of a sort, with n entries each.
struct SortKeys {
  std::uint32_t* key = nullptr;   // its cell, or kNoCell
  std::uint32_t* rank = nullptr;  // how many of that cell were counted before it
  std::uint32_t* num = nullptr;   // parcels counted so far, by cell
};

#if defined(__CUDACC__)
// Counts a parcel in a cell; returns what num[cell] was. Whole warps call it; is_parcel is false in threads
// without one.
__device__ inline std::uint32_t rank_in_cell(const GridShape& grid, std::uint32_t* num, std::uint32_t cell,
                                             bool is_parcel) {
  // Retired parcels, of which there may be millions, share one counter.
  const bool retired = is_parcel && cell == grid.num_cells();
  const unsigned all_retired = __ballot_sync(0xFFFFFFFFU, retired);
  const unsigned lane = threadIdx.x % 32;
  std::uint32_t base = 0;
  if (all_retired != 0) {
    const int leader = __ffs(static_cast<int>(all_retired)) - 1;
    if (lane == static_cast<unsigned>(leader))
      base = atomicAdd(&num[cell], static_cast<std::uint32_t>(__popc(all_retired)));
    base = __shfl_sync(0xFFFFFFFFU, base, leader);
  }
  if (retired) return base + static_cast<std::uint32_t>(__popc(all_retired & ((1U << lane) - 1U)));
  return is_parcel ? atomicAdd(&num[cell], 1U) : 0;
}

// Counts parcel i in its cell. Whole warps call it; is_parcel is false in threads without one.
__device__ inline void count_in_cell(const GridShape& grid, const SortKeys& keys, std::uint32_t i,
                                     Vec2i position, bool is_parcel) {
  const std::uint32_t cell = cell_key(grid, position);
  const std::uint32_t rank = rank_in_cell(grid, keys.num, cell, is_parcel);
  if (!is_parcel) return;
  keys.key[i] = cell;
  keys.rank[i] = rank;
}
#endif

// At most so many cells a parcel; twice as many would take 4 bytes a parcel more.
constexpr double kDeviceCellsPerParcel = 1.0;

// Arrays of the sort, `capacity` entries each.
struct SortScratch {
  std::uint64_t* keys;  // keys and ranks, of 32 bits each, taken as one
  std::uint32_t* counts;
};

// Holds keys, ranks and counts for `capacity` parcels, CUB's temporary storage, and the cell starts, which
// are valid until the next sort. Pointers to them are asked for anew after each.
class DeviceCellSort {
 public:
  DeviceCellSort() = default;
  explicit DeviceCellSort(std::uint32_t capacity);

  // Clears the counts of the grid's cells. The kernel that calls count_in_cell for all parcels follows.
  SortKeys begin(const GridShape& grid, cudaStream_t stream);
  // Begins, and counts the parcels at these positions.
  void count(const GridShape& grid, const Vec2i* position, std::uint32_t num_parcels, cudaStream_t stream);
  // Sums the counts: cell_start() becomes valid.
  void sum_counts(const GridShape& grid, cudaStream_t stream);
  // For a kernel that counts parcels by cell, and a later one that puts each where the entry of its cell then
  // says, and raises that. Clears these counts, of the grid's cells and of retired parcels.
  std::uint32_t* begin_places(const GridShape& grid, cudaStream_t stream);
  // Between the two: sums the counts. Once all parcels are placed cell_start() tells where they are; what it
  // was stays valid until the next begin.
  void sum_to_places(const GridShape& grid, cudaStream_t stream);
  // Copies parcels to their places, retired ones last. from and to must not overlap.
  void scatter(const ParcelPointers& from, const ParcelPointers& to, std::uint32_t num_parcels,
               cudaStream_t stream);
  // Maps `num` indices in device memory from the order before the scatter to the one after it. Before the
  // next begin().
  void update_indices(std::uint32_t* index, std::uint32_t num, cudaStream_t stream) const;

  const std::uint32_t* cell_start() const { return cell_start_.data(); }
  std::size_t bytes() const;
  // Bytes moved by a sort beside the parcels: for each cell a count is cleared, added to, and summed; keys
  // and ranks are written and read, and the starts of cells read. A sort with places has no keys.
  static constexpr double kMinBytesPerCell = 20.0, kMinBytesOfKeys = 20.0;
  // Bytes held for each parcel: keys, ranks, counts and cell starts, rounded up.
  static constexpr double kBytesPerParcel = 8.0 + 8.0 * kDeviceCellsPerParcel + 0.5;

  // Free for other use from the end of a sort, and the last update_indices() after it, to the next begin.
  SortScratch scratch() const { return {keys_.data(), counts_.data()}; }

 private:
  SortKeys keys() const;
  void sum_counts_to(std::uint32_t* sums, std::size_t num, cudaStream_t stream);

  DeviceBuffer<std::uint64_t> keys_;  // keys, then ranks
  DeviceBuffer<std::uint32_t> counts_;
  DeviceBuffer<std::uint32_t> cell_start_;
  DeviceBuffer<unsigned char> temporary_;
};

}  // namespace pf
