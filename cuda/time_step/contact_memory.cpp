#include "cuda/time_step/contact_memory.cuh"

#include "cuda/check.cuh"

namespace pf {

void ContactMemory::reserve(std::size_t capacity, cudaStream_t stream) {
  if (has_room(capacity)) return;
  *this = {};
  touched_ = DeviceBuffer<std::uint32_t>(capacity / 32 + 1);
  num_pairs_ = DeviceBuffer<std::uint32_t>(capacity / kPairList + 1);
  sums_ = DeviceBuffer<DeviceSums>(capacity / ContactScratch::kNumParts);
  PF_CUDA(cudaMemsetAsync(touched_.data(), 0, touched_.bytes(), stream));
  PF_CUDA(cudaMemsetAsync(num_pairs_.data(), 0, num_pairs_.bytes(), stream));
}

ContactScratch ContactMemory::lay_out(const DeviceParcels& next, const DeviceCellSort& cell_sort) const {
  static_assert(sizeof(DeviceSums) == ContactScratch::kNumParts * sizeof(Vec2i) &&
                sizeof(Vec2i) == sizeof(Vec2f) && sizeof(Vec2i) == sizeof(std::uint64_t));
  static_assert(kDeviceCellsPerParcel >= 1.0, "counts hold the second parcel of each pair");
  const SortScratch scratch = cell_sort.scratch();
  ContactScratch contacts;
  contacts.part[0] = reinterpret_cast<DeviceSums*>(next.position.data());
  contacts.part[1] = reinterpret_cast<DeviceSums*>(next.velocity.data());
  contacts.part[2] = reinterpret_cast<DeviceSums*>(scratch.keys);
  contacts.part[3] = sums_.data();
  contacts.num_in_part = static_cast<std::uint32_t>(sums_.capacity());
  contacts.touched = touched_.data();
  contacts.first = next.id.data();
  contacts.second = scratch.counts;
  contacts.num_pairs = num_pairs_.data();
  return contacts;
}

}  // namespace pf
