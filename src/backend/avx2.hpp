// AVX2 helpers that handle eight parcels at a time. AVX2 stands for the fused multiply-add as well: all
// processors have both or neither, except a few by VIA.
#pragma once

#if defined(__x86_64__)

#include <immintrin.h>

#include "model/world.hpp"

#define PF_AVX2 target("avx2,fma")

namespace pf {

inline bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}

// Eight pairs (x, y), four in each of two registers, split into all x and all y. The pairs are in the order
// 0 1 4 5 2 3 6 7.
struct Eight {
  __m256 x, y;
  __attribute__((PF_AVX2, always_inline)) Eight(__m256 a, __m256 b)
      : x(_mm256_shuffle_ps(a, b, 0x88)), y(_mm256_shuffle_ps(a, b, 0xDD)) {}
};

// Puts values in the order of Eight back into memory order.
__attribute__((PF_AVX2, always_inline)) inline __m256 in_order(__m256 values) {
  return _mm256_castpd_ps(_mm256_permute4x64_pd(_mm256_castps_pd(values), 0xD8));
}

// Nearest images of eight differences. Lanes alternate between x and y.
template <Boundary kBoundary>
__attribute__((PF_AVX2, always_inline)) inline __m256i nearest_image(__m256i d, __m256i half,
                                                                     __m256i period) {
  if constexpr (kBoundary == Boundary::periodic) {
    const __m256i too_high = _mm256_cmpgt_epi32(d, _mm256_sub_epi32(half, _mm256_set1_epi32(1)));
    const __m256i too_low = _mm256_cmpgt_epi32(_mm256_sub_epi32(_mm256_setzero_si256(), half), d);
    d = _mm256_sub_epi32(d, _mm256_and_si256(too_high, period));
    d = _mm256_add_epi32(d, _mm256_and_si256(too_low, period));
  }
  return d;
}

}  // namespace pf

#endif
