#include "backend/exact/bounding_discs.hpp"

#include <algorithm>
#include <cmath>

#include "backend/avx2.hpp"

namespace pf {
namespace {

void set_disc(const StepPaths& paths, std::size_t i, BoundingDiscs& discs, SpeedBounds& speeds) {
  const Vec2i start = paths.start[i];
  const Vec2f velocity = paths.velocity[i];
  const float speed2 = dot(velocity, velocity);
  const bool is_finite = speed2 < kMaxFiniteSpeed2;
  Disc disc = bounding_disc(start, velocity * paths.units_per_mps, paths.half_contact);
  if (is_retired(start) || !is_finite) disc.radius = std::nanf("");
  discs.set(i, disc);
  if (is_retired(start)) return;
  speeds.all_finite = speeds.all_finite && is_finite;
  if (is_finite) speeds.max2 = std::max(speeds.max2, speed2);
}

#if defined(__x86_64__)

__attribute__((PF_AVX2)) SpeedBounds set_discs_avx2(const StepPaths& paths, std::size_t begin,
                                                    std::size_t end, BoundingDiscs& discs) {
  const auto [start, velocity, units_per_mps, half_contact] = paths;
  SpeedBounds speeds;
  std::size_t i = begin;
  __m256 max2 = _mm256_setzero_ps(), not_finite = _mm256_setzero_ps();
  const __m256 scale = _mm256_set1_ps(units_per_mps), half = _mm256_set1_ps(0.5F);
  for (; i + 8 <= end; i += 8) {
    const auto* at = reinterpret_cast<const float*>(start + i);
    const Eight position(_mm256_loadu_ps(at), _mm256_loadu_ps(at + 8));
    const Eight v(_mm256_loadu_ps(&velocity[i].x), _mm256_loadu_ps(&velocity[i].x + 8));
    const __m256 retired =
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_castps_si256(position.x), _mm256_set1_epi32(kRetired)));
    const __m256 speed2 = _mm256_add_ps(_mm256_mul_ps(v.x, v.x), _mm256_mul_ps(v.y, v.y));
    const __m256 is_finite = _mm256_cmp_ps(speed2, _mm256_set1_ps(kMaxFiniteSpeed2), _CMP_LT_OQ);
    const __m256 valid = _mm256_andnot_ps(retired, is_finite);
    not_finite = _mm256_or_ps(not_finite, _mm256_andnot_ps(_mm256_or_ps(retired, is_finite),
                                                           _mm256_castsi256_ps(_mm256_set1_epi32(-1))));
    max2 = _mm256_max_ps(max2, _mm256_and_ps(speed2, valid));
    const __m256 path_x = _mm256_mul_ps(v.x, scale), path_y = _mm256_mul_ps(v.y, scale);
    const __m256 length =
        _mm256_sqrt_ps(_mm256_add_ps(_mm256_mul_ps(path_x, path_x), _mm256_mul_ps(path_y, path_y)));
    const __m256 x =
        _mm256_add_ps(_mm256_cvtepi32_ps(_mm256_castps_si256(position.x)), _mm256_mul_ps(half, path_x));
    const __m256 y =
        _mm256_add_ps(_mm256_cvtepi32_ps(_mm256_castps_si256(position.y)), _mm256_mul_ps(half, path_y));
    const __m256 radius =
        _mm256_add_ps(_mm256_mul_ps(_mm256_add_ps(_mm256_set1_ps(half_contact), _mm256_mul_ps(half, length)),
                                    _mm256_set1_ps(kDiscRelative)),
                      _mm256_set1_ps(kDiscMargin));
    const __m256 no_radius = _mm256_set1_ps(std::nanf(""));
    _mm256_storeu_ps(&discs.x[i], in_order(x));
    _mm256_storeu_ps(&discs.y[i], in_order(y));
    _mm256_storeu_ps(&discs.radius[i], in_order(_mm256_blendv_ps(no_radius, radius, valid)));
  }
  alignas(32) float lanes[8];
  _mm256_store_ps(lanes, max2);
  speeds.max2 = *std::max_element(lanes, lanes + 8);
  speeds.all_finite = _mm256_movemask_ps(not_finite) == 0;
  for (; i < end; ++i) set_disc(paths, i, discs, speeds);
  return speeds;
}

#endif

}  // namespace

SpeedBounds set_discs(const StepPaths& paths, std::size_t begin, std::size_t end, BoundingDiscs& discs) {
#if defined(__x86_64__)
  if (has_avx2()) return set_discs_avx2(paths, begin, end, discs);
#endif
  SpeedBounds speeds;
  for (std::size_t i = begin; i < end; ++i) set_disc(paths, i, discs, speeds);
  return speeds;
}

}  // namespace pf
