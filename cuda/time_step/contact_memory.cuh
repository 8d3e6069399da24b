// Memory of the contacts of a step that is done in parts.
#pragma once

#include "cuda/cell_sort.cuh"
#include "cuda/time_step/kernel.cuh"

namespace pf {

// Between two sorts the sort's own memory holds most of it: the arrays that it scatters to, its keys and its
// counts.
class ContactMemory {
 public:
  // Parcels for each pair that short lists share room for.
  static constexpr std::size_t kParcelsPerPooled = 32;
  // Held for each parcel beside the sort's.
  static constexpr double kBytesPerParcel =
      static_cast<double>(sizeof(DeviceSums)) / ContactScratch::kNumParts + 0.3 + 8.0 / kParcelsPerPooled;

  // Returns whether it has room for `capacity` parcels.
  bool has_room(std::size_t capacity) const { return capacity_ >= capacity && capacity_ > 0; }
  // Does nothing if it has room for `capacity` parcels.
  void reserve(std::size_t capacity, cudaStream_t stream);
  std::size_t bytes() const {
    return sums_.bytes() + 2 * touched_.bytes() + num_pairs_.bytes() + pooled_.bytes() + num_pooled_.bytes();
  }

  // next: where the next sort scatters to. Both have room for `capacity` parcels, too.
  ContactScratch lay_out(const DeviceParcels& next, const DeviceCellSort& cell_sort) const;
  // The same for a step that sorts to `next`.
  ContactScratch lay_out_to_sort(const DeviceParcels& next) const;

 private:
  ContactScratch own_part() const;

  std::size_t capacity_ = 0;       // parcels
  DeviceBuffer<DeviceSums> sums_;  // the last part, and the few of a step that sorts
  DeviceBuffer<std::uint32_t> touched_, touched_again_, num_pairs_;
  DeviceBuffer<std::uint32_t> pooled_, num_pooled_;
};

// So many parcels or a few more, so that the sums have equal parts.
constexpr std::size_t in_equal_parts(std::size_t num_parcels) {
  constexpr std::size_t kParts = ContactScratch::kNumParts;
  return (num_parcels + kParts - 1) / kParts * kParts;
}

}  // namespace pf
