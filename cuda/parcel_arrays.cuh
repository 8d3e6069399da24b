// The parcels' arrays on the device.
#pragma once

#include <cstdint>

#include "core/vec2.hpp"
#include "cuda/device_buffer.cuh"

namespace pf {

// A bit of an id in a domain (cuda/domains): the parcel is a copy of another domain's, which touches, but
// does not move here.
constexpr std::uint32_t kCopyBit = 1U << 31, kIdBits = kCopyBit - 1;

// Parcels in memory order, n entries each; by value to kernels.
struct ParcelPointers {
  Vec2i* position = nullptr;
  Vec2f* velocity = nullptr;
  std::uint32_t* id = nullptr;
  std::uint32_t* tick = nullptr;               // method `exact` only, else null
  std::uint32_t* last_contact_tick = nullptr;  // method `exact` with a contact duration only, else null
};

// Owner of the arrays. Method `exact` allocates the last two when it needs them.
struct DeviceParcels {
  DeviceBuffer<Vec2i> position;
  DeviceBuffer<Vec2f> velocity;
  DeviceBuffer<std::uint32_t> id;
  DeviceBuffer<std::uint32_t> tick, last_contact_tick;

  DeviceParcels() = default;
  // One position more, which a search may read and ignores.
  explicit DeviceParcels(std::size_t capacity) : position(capacity + 1), velocity(capacity), id(capacity) {}

  ParcelPointers pointers() const {
    return {position.data(), velocity.data(), id.data(), tick.data(), last_contact_tick.data()};
  }
  std::size_t bytes() const {
    return position.bytes() + velocity.bytes() + id.bytes() + tick.bytes() + last_contact_tick.bytes();
  }
};

}  // namespace pf
