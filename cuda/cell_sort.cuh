// Radix sort of the parcels by cell (CUB), the gather that reorders them, and the start of each cell.
#pragma once

#include "cuda/device_buffer.cuh"
#include "cuda/time_step/state.cuh"

namespace pf {

// At most so many cells: twice as many would take 4 bytes a parcel more.
constexpr double kDeviceCellsPerParcel = 1.0;

// Scratch of the sort: two arrays of keys and two of indices for `capacity` parcels, CUB's temporary storage,
// and the cell starts. Kept between sorts; nothing is allocated in a step.
class DeviceCellSort {
 public:
  DeviceCellSort() = default;
  explicit DeviceCellSort(std::uint32_t capacity);

  // Where keys and indices go before sort_keys, for a kernel that writes them on its way.
  SortKeys keys_to_write() const { return {keys_[0].data(), indices_[0].data()}; }
  // Writes them for the parcels' cells.
  void write_keys(const GridShape& grid, const Vec2i* position, std::uint32_t num_parcels,
                  cudaStream_t stream);
  // Sorts them by key: stable, only the bits in use.
  void sort_keys(const GridShape& grid, std::uint32_t num_parcels, cudaStream_t stream);
  // from -> to in the order of the sorted keys (must not overlap); cell_start() becomes valid. Retired
  // parcels last.
  void gather(const GridShape& grid, const ParcelPointers& from, const ParcelPointers& to,
              std::uint32_t num_parcels, cudaStream_t stream);

  const std::uint32_t* cell_start() const { return cell_start_.data(); }
  std::size_t bytes() const;
  // Keys and indices written, read and written by each pass of 8 bits, read by the gather.
  static double min_bytes_per_parcel(const GridShape& grid);
  // What a sorter holds for each parcel: keys, indices, cell starts, and CUB's storage rounded up.
  static constexpr double kBytesPerParcel = 16.0 + 4.0 * kDeviceCellsPerParcel + 1.0;

  // Three arrays as long as the parcels, for whoever needs them between a gather and the next keys.
  std::uint32_t* scratch(int k) const {
    return k == 0 ? keys_[0].data() : k == 1 ? keys_[1].data() : indices_[0].data();
  }

 private:
  DeviceBuffer<std::uint32_t> keys_[2];
  DeviceBuffer<std::uint32_t> indices_[2];
  DeviceBuffer<std::uint32_t> cell_start_;
  DeviceBuffer<unsigned char> temporary_;
  int sorted_ = 0;  // which of the two arrays holds the sorted ones
};

}  // namespace pf
