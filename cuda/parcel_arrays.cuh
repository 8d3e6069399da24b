// The parcels' arrays on the device.
#pragma once

#include <cstdint>

#include "core/vec2.hpp"
#include "cuda/device_buffer.cuh"

namespace pf {

// A bit of an id in a domain (cuda/domains): the parcel is a ghost, a copy of another domain's, which
// touches, but does not move here.
constexpr std::uint32_t kGhostBit = 1U << 31, kIdBits = kGhostBit - 1;

// Parcels in memory order, n entries each; by value to kernels.
struct ParcelPointers {
  Vec2i* position = nullptr;
  Vec2f* velocity = nullptr;
  std::uint32_t* id = nullptr;
  std::uint32_t* heated = nullptr;             // a bit for each, see Parcel; (n + 31) / 32 entries
  std::uint32_t* tick = nullptr;               // method `exact` only, else null
  std::uint32_t* last_contact_tick = nullptr;  // method `exact` with a contact duration only, else null
};

// Positions that a search may read beyond the last one. Method `exact` keeps some where velocities were.
constexpr std::size_t kReadBeyond = 3;

// Owner of the arrays. Method `exact` allocates the last two when it needs them.
struct DeviceParcels {
  DeviceBuffer<Vec2i> position;
  DeviceBuffer<Vec2f> velocity;
  DeviceBuffer<std::uint32_t> id;
  DeviceBuffer<std::uint32_t> heated;
  DeviceBuffer<std::uint32_t> tick, last_contact_tick;

  DeviceParcels() = default;
  explicit DeviceParcels(std::size_t capacity)
      : position(capacity + kReadBeyond),
        velocity(capacity + kReadBeyond),
        id(capacity),
        heated(num_words(capacity)) {}

  // Number of words with a bit for each parcel.
  static constexpr std::size_t num_words(std::size_t num_parcels) { return (num_parcels + 31) / 32; }

  ParcelPointers pointers() const {
    return {position.data(), velocity.data(), id.data(),
            heated.data(),   tick.data(),     last_contact_tick.data()};
  }
  std::size_t bytes() const {
    return position.bytes() + velocity.bytes() + id.bytes() + heated.bytes() + tick.bytes() +
           last_contact_tick.bytes();
  }
};

#if defined(__CUDACC__)
__device__ inline std::uint32_t is_heated(const ParcelPointers& parcels, std::uint32_t i) {
  return parcels.heated[i / 32] >> (i % 32) & 1U;
}

// While other threads may set bits of the same word.
__device__ inline void set_heated(const ParcelPointers& parcels, std::uint32_t i, std::uint32_t value) {
  const std::uint32_t bit = 1U << (i % 32);
  if (value != 0)
    atomicOr(&parcels.heated[i / 32], bit);
  else
    atomicAnd(&parcels.heated[i / 32], ~bit);
}

// Sets the bits of a warp's parcels, i and following. Whole warps call it.
__device__ inline void set_heated_of_warp(const ParcelPointers& parcels, std::uint32_t i, bool value,
                                          std::uint32_t num) {
  const unsigned word = __ballot_sync(0xFFFFFFFFU, value);
  if (i % 32 == 0 && i < num) parcels.heated[i / 32] = word;
}
#endif

}  // namespace pf
