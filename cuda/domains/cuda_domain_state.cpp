// Access of others to a slab on a GPU.
#include "cuda/domains/cuda_domain.cuh"
#include "cuda/domains/transfer.cuh"
#include "cuda/profile.cuh"
#include "cuda/setup_kernels.cuh"

namespace pf {

void CudaDomain::visit(const std::function<void(const Parcel&)>& see) const {
  const DeviceScope scope(device_);
  std::vector<Vec2i> position(num_);
  std::vector<Vec2f> velocity(num_);
  std::vector<std::uint32_t> id(num_), heated(DeviceParcels::num_words(num_));
  to_host(position.data(), current_.position.data(), num_, stream_);
  to_host(velocity.data(), current_.velocity.data(), num_, stream_);
  to_host(id.data(), current_.id.data(), num_, stream_);
  to_host(heated.data(), current_.heated.data(), heated.size(), stream_);
  synchronize();
  for (std::uint32_t i = 0; i < num_; ++i) {
    if ((id[i] & kGhostBit) == 0)
      see({position[i], velocity[i], id[i] & kIdBits, heated[i / 32] >> (i % 32) & 1U});
  }
}

ParcelSums CudaDomain::sums(double mass_kg) const {
  const DeviceScope scope(device_);
  return sum_parcels(current_.pointers(), num_, mass_kg, stream_);
}

void CudaDomain::add_to(Profile& profile) const {
  const DeviceScope scope(device_);
  add_parcels(profile, current_.pointers(), num_, stream_);
}

void CudaDomain::count(const PixelGrid& grid, const CountStyle& style, std::vector<std::uint32_t>& pixels) {
  const DeviceScope scope(device_);
  const std::size_t num = pixels.size();
  if (pixels_.capacity() < num) {
    pixels_ = DeviceBuffer<std::uint32_t>(num);
    host_pixels_ = PinnedBuffer<std::uint32_t>(num);
  }
  PF_CUDA(cudaMemsetAsync(pixels_.data(), 0, num * sizeof(std::uint32_t), stream_));
  launch_count_pixels(current_.pointers(), num_, slabs_.world, {grid, style, pixels_.data()}, stream_);
  to_host(host_pixels_.data(), pixels_.data(), num, stream_);
  synchronize();
  for (std::size_t k = 0; k < num; ++k) pixels[k] += host_pixels_.data()[k];
}

void CudaDomain::gather(const PixelGrid& grid, std::vector<DrawnParcel>& to) const {
  const DeviceScope scope(device_);
  const DeviceBuffer<std::uint32_t> seen(num_);
  launch_find_seen(current_.pointers(), num_, slabs_.world, grid, {seen.data(), counts_.data()}, stream_);
  std::uint32_t num = 0;
  to_host(&num, counts_.data(), 1, stream_);
  synchronize();
  const DeviceBuffer<Parcel> parcels(num);
  std::vector<Parcel> gathered(num);
  launch_gather(current_.pointers(), seen.data(), num, parcels.data(), stream_);
  to_host(gathered.data(), parcels.data(), num, stream_);
  synchronize();
  for (const Parcel& parcel : gathered)
    to.push_back(drawn_parcel(slabs_.world, parcel.position, parcel.velocity));
}

std::uint64_t CudaDomain::memory_bytes() const {
  return current_.bytes() + next_.bytes() + cell_sort_.bytes() + contact_memory_.bytes() + traffic_.bytes() +
         near_.bytes() + sent_.bytes() + ghosts_.bytes();
}

}  // namespace pf
