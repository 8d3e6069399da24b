// Floats as fixed-point numbers and back. The GPU uses 32-bit conversions: 64-bit ones are many times slower
// on graphics cards.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/portable_math.hpp"

namespace pf {

// Nearest integer, ties to even, of a magnitude below 2^31. 0 for NaN, and beyond that undefined.
PF_HD inline std::int32_t round_to_int32(float value) {
#if defined(__CUDA_ARCH__)
  return __float2int_rn(value);
#else
  return static_cast<std::int32_t>(std::lrint(value));
#endif
}

PF_HD inline std::int32_t round_to_int32(double value) {
  return static_cast<std::int32_t>(round_to_int64(value));
}

// a b - product, rounded once. product: a * b rounded to float, so that the result is its rounding error.
PF_HD inline float lost_in_product(float a, float b, float product) {
#if defined(__CUDA_ARCH__)
  return __fmaf_rn(a, b, -product);
#else
  return static_cast<float>(static_cast<double>(a) * static_cast<double>(b) - static_cast<double>(product));
#endif
}

// Counts of 2^-kBits, the nearest, ties to even. The function is odd, so that opposite contributions cancel
// exactly. The smallest integer stands for a value that is not finite, or of magnitude 2^30 or more.
template <int kBits>
PF_HD inline std::int64_t to_fixed(float value) {
  if (!(std::fabs(value) < 0x1p30F)) return INT64_MIN;
#if defined(__CUDA_ARCH__)
  const std::int32_t whole = round_to_int32(value);
  const float rest = value - static_cast<float>(whole);  // exact, at most a half
  // The last digit of this sum counts ones, which is cheaper than a conversion.
  static_assert(kBits <= 22);
  constexpr float kOnes = 0x1.8p23F;
  const std::int32_t counts = __float_as_int(__fmaf_rn(rest, 1 << kBits, kOnes)) - __float_as_int(kOnes);
  return static_cast<std::int64_t>(whole) * (1 << kBits) + counts;
#else
  return std::llrint(value * (1 << kBits));
#endif
}

// Returns whether -2^kBits <= value < 2^kBits, 32 <= kBits. The high word tells.
template <int kBits>
PF_HD inline bool is_within_bits(std::int64_t value) {
  constexpr std::int32_t kEnd = 1 << (kBits - 32);
  const auto high = static_cast<std::int32_t>(value >> 32);
  return high >= -kEnd && high < kEnd;
}

// The reverse of to_fixed(): the nearest float. 8 <= kBits <= 24.
template <int kBits>
PF_HD inline float from_fixed(std::int64_t counts) {
  constexpr float kUnit = 1.0F / (1 << kBits);
#if defined(__CUDA_ARCH__)
  if (is_within_bits<24 + kBits>(counts)) {
    const auto whole = static_cast<std::int32_t>(counts >> kBits);
    const auto rest = static_cast<std::int32_t>(counts & ((1 << kBits) - 1));
    return __fmaf_rn(static_cast<float>(rest), kUnit, static_cast<float>(whole));  // both are exact
  }
#endif
  return static_cast<float>(counts) * kUnit;
}

// Exact up to 2^24.
PF_HD inline float to_float(std::uint64_t value) {
  return static_cast<float>(static_cast<std::uint32_t>(value >> 32)) * 0x1p32F +
         static_cast<float>(static_cast<std::uint32_t>(value));
}

}  // namespace pf
