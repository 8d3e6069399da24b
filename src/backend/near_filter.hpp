// The first test for contact of a parcel with eight others at a time.
#pragma once

#include "backend/avx2.hpp"
#include "backend/neighbour_search.hpp"

#if defined(__x86_64__)

namespace pf {

// Tests eight parcels, first .. first + 7, at a time. Sets a bit for each that is below last, near, and not
// self.
template <Boundary kBoundary>
struct Filter {
  const SearchSpace& space;
  __m256i centre, half, period, self;

  __attribute__((PF_AVX2, always_inline)) Filter(const SearchSpace& in, std::uint32_t i) : space(in) {
    const int hx = in.world.half.x, hy = in.world.half.y;
    centre = _mm256_set1_epi64x(bit_copy<long long>(in.position[i]));
    half = _mm256_set_epi32(hy, hx, hy, hx, hy, hx, hy, hx);
    period = _mm256_slli_epi32(half, 1);
    self = _mm256_set1_epi32(static_cast<int>(i));
  }

  __attribute__((PF_AVX2, always_inline)) __m256 is_near(std::uint32_t first) const {
    const auto* at = reinterpret_cast<const __m256i*>(space.position + first);
    const __m256i a = _mm256_sub_epi32(_mm256_loadu_si256(at), centre);
    const __m256i b = _mm256_sub_epi32(_mm256_loadu_si256(at + 1), centre);
    const Eight e(_mm256_cvtepi32_ps(nearest_image<kBoundary>(a, half, period)),
                  _mm256_cvtepi32_ps(nearest_image<kBoundary>(b, half, period)));
    const __m256 squared = _mm256_add_ps(_mm256_mul_ps(e.x, e.x), _mm256_mul_ps(e.y, e.y));
    return _mm256_cmp_ps(squared, _mm256_set1_ps(space.filter_distance2), _CMP_LT_OQ);
  }

  __attribute__((PF_AVX2, always_inline)) unsigned wanted(std::uint32_t first, std::uint32_t last) const {
    const __m256i order = _mm256_set_epi32(7, 6, 3, 2, 5, 4, 1, 0);
    const __m256i index = _mm256_add_epi32(order, _mm256_set1_epi32(static_cast<int>(first)));
    const __m256i inside = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(last)), index);
    const __m256i others = _mm256_andnot_si256(_mm256_cmpeq_epi32(index, self), inside);
    return static_cast<unsigned>(
        _mm256_movemask_ps(_mm256_and_ps(_mm256_castsi256_ps(others), is_near(first))));
  }
};

// The order of Eight.
constexpr std::uint32_t kOrder[8] = {0, 1, 4, 5, 2, 3, 6, 7};

}  // namespace pf

#endif
