#include "cuda/profile.cuh"

#include <vector>

#include "cuda/blocks.cuh"
#include "cuda/check.cuh"
#include "cuda/device_buffer.cuh"
#include "cuda/tally.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256, kWarp = 32;
constexpr unsigned kOfWarp = 1024;  // parcels, which lie in a few bins: they are in the order of cells
constexpr unsigned kAll = 0xFFFFFFFFU;

__device__ std::int64_t sum_over_warp(std::int64_t value) {
  return static_cast<std::int64_t>(pf::sum_over_warp(static_cast<unsigned long long>(value)));
}

__device__ void add(std::int64_t value, std::int64_t& to) {
  atomicAdd(reinterpret_cast<unsigned long long*>(&to), static_cast<unsigned long long>(value));
}

// The sums of a bin, in parts that the lanes of a warp have.
struct OpenBin {
  std::uint32_t bin;
  ProfileSums sums;

  // Whole warps call it. bins: in memory.
  __device__ void close(ProfileSums* bins) {
    const ProfileSums sum = {sum_over_warp(sums.num), sum_over_warp(sums.along), sum_over_warp(sums.across),
                             sum_over_warp(sums.square)};
    sums = {};
    if (threadIdx.x % kWarp != 0 || sum.num == 0) return;
    add(sum.num, bins[bin].num);
    add(sum.along, bins[bin].along);
    add(sum.across, bins[bin].across);
    add(sum.square, bins[bin].square);
  }
};

// Each warp adds up kOfWarp parcels that follow each other in memory.
__global__ void profile_kernel(const ParcelPointers parcels, std::uint32_t n, const ProfileShape shape,
                               ProfileSums* bins) {
  const std::uint32_t first = (blockIdx.x * (kBlock / kWarp) + threadIdx.x / kWarp) * kOfWarp;
  OpenBin open{0, {}};
  for (std::uint32_t k = 0; k < kOfWarp && first + k < n; k += kWarp) {
    const std::uint32_t i = first + k + threadIdx.x % kWarp;
    ProfilePlace place;
    bool counts = i < n && (parcels.id[i] & kGhostBit) == 0 && !is_retired(parcels.position[i]);
    if (counts) place = profile_place(shape, parcels.position[i]);
    counts = counts && place.bin < shape.num_bins;
    for (unsigned left = __ballot_sync(kAll, counts); left != 0;) {
      const std::uint32_t bin = __shfl_sync(kAll, place.bin, __ffs(left) - 1);
      if (bin != open.bin) {
        open.close(bins);
        open.bin = bin;
      }
      const bool is_here = counts && place.bin == bin;
      if (is_here) open.sums += profile_sums(shape, place.direction, parcels.velocity[i]);
      left &= ~__ballot_sync(kAll, is_here);
    }
  }
  open.close(bins);
}

}  // namespace

void add_parcels(Profile& profile, const ParcelPointers& parcels, std::uint32_t num_parcels,
                 cudaStream_t stream) {
  if (profile.bins.empty() || num_parcels == 0) return;
  const DeviceBuffer<ProfileSums> on_device(profile.bins.size());
  PF_CUDA(cudaMemsetAsync(on_device.data(), 0, on_device.bytes(), stream));
  profile_kernel<<<blocks_for(num_parcels, kOfWarp * (kBlock / kWarp)), kBlock, 0, stream>>>(
      parcels, num_parcels, profile.shape, on_device.data());
  PF_LAUNCHED("profile_kernel");
  const std::vector<ProfileSums> sums = download(on_device, profile.bins.size(), stream);
  for (std::size_t k = 0; k < sums.size(); ++k) profile.bins[k] += sums[k];
}

}  // namespace pf
