// Mathematical functions beyond + - * / sqrt. They are written out so that host and device give the same
// bits: maths libraries differ in the last place. Errors are below 2e-16 relative to 1.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/host_device.hpp"

namespace pf {

constexpr double kPi = 3.14159265358979323846;

// Nearest integer, ties to even. The function is odd, so that opposite contributions cancel exactly.
PF_HD inline std::int64_t round_to_int64(double value) {
#if defined(__CUDA_ARCH__)
  return __double2ll_rn(value);
#else
  return std::llrint(value);
#endif
}

template <class To, class From>
PF_HD To bit_copy(const From& from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  memcpy(&to, &from, sizeof(To));
  return to;
}

struct SinCos {
  double sin, cos;
};

// Sine and cosine for |angle| < 2^20: reduction to [-pi/4, pi/4] (Cody and Waite 1980, two parts), then
// Taylor series.
PF_HD inline SinCos sin_cos(double angle) {
  const double quadrant = static_cast<double>(round_to_int64(angle * (2.0 / kPi)));
  const double x = (angle - quadrant * 1.57079632673412561417e+00) - quadrant * 6.07710050650619224932e-11;
  const double z = x * x;
  double s = -1.0 / 1307674368000.0;
  s = s * z + 1.0 / 6227020800.0;
  s = s * z - 1.0 / 39916800.0;
  s = s * z + 1.0 / 362880.0;
  s = s * z - 1.0 / 5040.0;
  s = s * z + 1.0 / 120.0;
  s = s * z - 1.0 / 6.0;
  s = x + x * (z * s);
  double c = 1.0 / 20922789888000.0;
  c = c * z - 1.0 / 87178291200.0;
  c = c * z + 1.0 / 479001600.0;
  c = c * z - 1.0 / 3628800.0;
  c = c * z + 1.0 / 40320.0;
  c = c * z - 1.0 / 720.0;
  c = c * z + 1.0 / 24.0;
  c = 1.0 + z * (z * c - 0.5);
  switch (static_cast<std::int64_t>(quadrant) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

// Natural logarithm of a positive normal number: exponent, plus 2 artanh((m - 1) / (m + 1)) of the mantissa.
PF_HD inline double natural_log(double value) {
  std::uint64_t bits = bit_copy<std::uint64_t>(value);
  std::int64_t exponent = static_cast<std::int64_t>(bits >> 52) - 1022;
  bits = (bits & 0x000FFFFFFFFFFFFFULL) | 0x3FE0000000000000ULL;
  double mantissa = bit_copy<double>(bits);
  if (mantissa < 0.70710678118654752440) {
    mantissa *= 2.0;
    exponent -= 1;
  }
  const double s = (mantissa - 1.0) / (mantissa + 1.0);
  const double z = s * s;
  double sum = 0.0;
  for (int k = 21; k >= 3; k -= 2) sum = (sum + 1.0 / k) * z;
  return static_cast<double>(exponent) * 0.69314718055994530942 + (2.0 * s + 2.0 * s * sum);
}

}  // namespace pf
