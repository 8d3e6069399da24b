#include "cuda/time_step/contact_memory.cuh"

#include "cuda/check.cuh"

namespace pf {

void ContactMemory::reserve(std::size_t capacity, cudaStream_t stream) {
  if (has_room(capacity)) return;
  *this = {};
  const std::size_t num_lists = capacity / kPairList + 1;
  sums_ = DeviceBuffer<DeviceSums>(num_lists * ContactScratch::kFewSums);
  touched_ = DeviceBuffer<std::uint32_t>(num_lists * kPairList / 32);
  touched_again_ = DeviceBuffer<std::uint32_t>(touched_.capacity());
  num_pairs_ = DeviceBuffer<std::uint32_t>(num_lists);
  pooled_ = DeviceBuffer<std::uint32_t>(2 * (capacity / kParcelsPerPooled));
  num_pooled_ = DeviceBuffer<std::uint32_t>(1);
  capacity_ = capacity;
  for (DeviceBuffer<std::uint32_t>* zeros : {&touched_, &touched_again_, &num_pairs_, &num_pooled_})
    PF_CUDA(cudaMemsetAsync(zeros->data(), 0, zeros->bytes(), stream));
}

ContactScratch ContactMemory::own_part() const {
  ContactScratch contacts;
  contacts.touched = touched_.data();
  contacts.touched_again = touched_again_.data();
  contacts.num_pairs = num_pairs_.data();
  contacts.max_pooled = static_cast<std::uint32_t>(capacity_ / kParcelsPerPooled);
  contacts.pooled_first = pooled_.data();
  contacts.pooled_second = pooled_.data() + contacts.max_pooled;
  contacts.num_pooled = num_pooled_.data();
  return contacts;
}

ContactScratch ContactMemory::lay_out(const DeviceParcels& next, const DeviceCellSort& cell_sort) const {
  static_assert(sizeof(DeviceSums) == ContactScratch::kNumParts * sizeof(Vec2i) &&
                sizeof(Vec2i) == sizeof(Vec2f) && sizeof(Vec2i) == sizeof(std::uint64_t));
  static_assert(ContactScratch::kFewSums * ContactScratch::kNumParts == kPairList);
  static_assert(kDeviceCellsPerParcel >= 1.0, "counts hold the second parcel of each pair");
  const SortScratch scratch = cell_sort.scratch();
  ContactScratch contacts = own_part();
  contacts.part[0] = reinterpret_cast<DeviceSums*>(next.position.data());
  contacts.part[1] = reinterpret_cast<DeviceSums*>(next.velocity.data());
  contacts.part[2] = reinterpret_cast<DeviceSums*>(scratch.keys);
  contacts.part[3] = sums_.data();
  contacts.first = next.id.data();
  contacts.second = scratch.counts;
  return contacts;
}

ContactScratch ContactMemory::lay_out_to_sort(const DeviceParcels& next) const {
  static_assert(sizeof(Vec2i) == 2 * sizeof(std::uint32_t));
  ContactScratch contacts = own_part();
  contacts.few = sums_.data();
  contacts.first = reinterpret_cast<std::uint32_t*>(next.position.data());
  contacts.second = contacts.first + capacity_;
  return contacts;
}

}  // namespace pf
