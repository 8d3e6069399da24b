// AVX2 helpers that handle eight parcels at a time.
#pragma once

#if defined(__x86_64__)

#include <immintrin.h>

#define PF_AVX2 target("avx2")

namespace pf {

inline bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2");
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

}  // namespace pf

#endif
