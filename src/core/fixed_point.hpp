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
  constexpr float kOne = 1 << kBits;
  if (!(std::fabs(value) < 0x1p30F)) return INT64_MIN;
#if defined(__CUDA_ARCH__)
  const std::int32_t whole = round_to_int32(value);
  const float rest = value - static_cast<float>(whole);  // exact
  return static_cast<std::int64_t>(whole) * (1 << kBits) + round_to_int32(rest * kOne);
#else
  return std::llrint(value * kOne);
#endif
}

// The reverse: the nearest float. kBits <= 24.
template <int kBits>
PF_HD inline float from_fixed(std::int64_t counts) {
  constexpr float kUnit = 1.0F / (1 << kBits);
#if defined(__CUDA_ARCH__)
  const std::int64_t whole = counts >> kBits;
  if (whole >= -(1 << 24) && whole <= 1 << 24) {
    const auto rest = static_cast<std::int32_t>(counts & ((1 << kBits) - 1));
    return static_cast<float>(static_cast<std::int32_t>(whole)) + static_cast<float>(rest) * kUnit;
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
