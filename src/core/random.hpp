// Counter-based random numbers. Each is a pure function of its keys, so any thread can draw it in any order.
// mix64 is the finaliser of SplitMix64 (Steele, Lea and Flood 2014). mix32 is the two-multiply hash
// 'lowbias32' (Wellons 2018).
#pragma once

#include <cstdint>

#include "core/host_device.hpp"

namespace pf {

PF_HD constexpr std::uint64_t mix64(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

PF_HD constexpr std::uint32_t mix32(std::uint32_t z) {
  z = (z ^ (z >> 16)) * 0x7FEB352DU;
  z = (z ^ (z >> 15)) * 0x846CA68BU;
  return z ^ (z >> 16);
}

// 64 random bits keyed by (seed, id, stream). Streams of one id are independent.
PF_HD constexpr std::uint64_t random_bits(std::uint64_t seed, std::uint64_t id, std::uint64_t stream) {
  return mix64(mix64(mix64(seed) ^ id) ^ (stream * 0xD1B54A32D192ED03ULL));
}

// Uniform above 0 and up to 1, one of 2^53 values half a step off a grid; in the upper half rounded to it.
PF_HD constexpr double uniform(std::uint64_t bits) {
  return (static_cast<double>(bits >> 11) + 0.5) * (1.0 / 9007199254740992.0);
}

}  // namespace pf
