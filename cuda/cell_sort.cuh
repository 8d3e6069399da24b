// Radix sort of the parcels by cell (CUB), the gather that reorders them, and the first parcel of each cell.
#pragma once

#include "cuda/parcel_arrays.cuh"
#include "model/grid.hpp"

namespace pf {

// Keys and indices of a sort, n entries each; null: none is written.
struct SortKeys {
  std::uint32_t* key = nullptr;
  std::uint32_t* index = nullptr;
};

// At most so many cells a parcel; twice as many would take 4 bytes a parcel more.
constexpr double kDeviceCellsPerParcel = 1.0;

// Arrays of the sort, `capacity` entries each.
struct SortScratch {
  std::uint64_t* keys;  // the arrays of keys, of 32 bits each, taken as one
  std::uint32_t* indices;
};

// Holds two arrays of keys and two of indices for `capacity` parcels, CUB's temporary storage, and the cell
// starts, which are valid until the next gather. Nothing is allocated in a step.
class DeviceCellSort {
 public:
  DeviceCellSort() = default;
  explicit DeviceCellSort(std::uint32_t capacity);

  // Where keys and indices go before sort_keys, for a kernel that writes them itself.
  SortKeys keys_to_write() const { return {keys(0), indices_[0].data()}; }
  // Writes them for the cells of the positions.
  void write_keys(const GridShape& grid, const Vec2i* position, std::uint32_t num_parcels,
                  cudaStream_t stream);
  // Sorts the indices by key. Stable; looks at the bits in use only.
  void sort_keys(const GridShape& grid, std::uint32_t num_parcels, cudaStream_t stream);
  // Copies parcels in the order of the sorted keys, retired ones last; cell_start() becomes valid. from and
  // to must not overlap.
  void gather(const GridShape& grid, const ParcelPointers& from, const ParcelPointers& to,
              std::uint32_t num_parcels, cudaStream_t stream);

  const std::uint32_t* cell_start() const { return cell_start_.data(); }
  std::size_t bytes() const;
  // Bytes moved by a sort: keys and indices are written once, read and written by each pass of 8 bits, and
  // read by the gather.
  static double min_bytes_per_parcel(const GridShape& grid);
  // Bytes held for each parcel: keys, indices, cell starts, and CUB's storage rounded up.
  static constexpr double kBytesPerParcel = 16.0 + 4.0 * kDeviceCellsPerParcel + 1.0;

  // Free for other use from a gather to the next keys.
  SortScratch scratch() const { return {keys_.data(), indices_[0].data()}; }

 private:
  // The first and the second array of keys.
  std::uint32_t* keys(int which) const {
    return reinterpret_cast<std::uint32_t*>(keys_.data()) + which * keys_.capacity();
  }

  DeviceBuffer<std::uint64_t> keys_;
  DeviceBuffer<std::uint32_t> indices_[2];
  DeviceBuffer<std::uint32_t> cell_start_;
  DeviceBuffer<unsigned char> temporary_;
  int sorted_ = 0;  // index of the arrays that hold the sorted keys and indices
};

}  // namespace pf
