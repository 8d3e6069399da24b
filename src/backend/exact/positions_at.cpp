#include "backend/exact/positions_at.hpp"

#include "backend/avx2.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

template <Boundary kBoundary>
void evaluate_plainly(const ExactConstants& c, const TrajectoryArrays& trajectories, std::int32_t tick,
                      std::size_t begin, std::size_t end, Vec2i* position) {
  for (std::size_t i = begin; i < end; ++i) {
    const Trajectory trajectory{trajectories.anchor[i], trajectories.velocity[i], trajectories.tick[i]};
    position[i] = place_at<kBoundary>(c, trajectory, tick);
  }
}

#if defined(__x86_64__)

// Evaluates four parcels at a time. The plain loop takes a group in which a parcel has retired, reaches an
// edge, has no finite speed, or moves so far that 32 bits might not hold the displacement.
template <Boundary kBoundary>
__attribute__((PF_AVX2)) void evaluate_avx2(const ExactConstants& c, const TrajectoryArrays& trajectories,
                                            std::int32_t tick, std::size_t begin, std::size_t end,
                                            Vec2i* position) {
  const World& world = c.run.physics.world;
  const std::int32_t margin = kBoundary == Boundary::walls ? wall_radius(c.run) : 0;
  const int hx = world.half.x - margin, hy = world.half.y - margin;
  const int excluded = kBoundary == Boundary::periodic ? 1 : 0;  // the upper edge is the lower one's image
  const __m256i high =
      _mm256_sub_epi32(_mm256_set_epi32(hy, hx, hy, hx, hy, hx, hy, hx), _mm256_set1_epi32(excluded));
  const __m256i low = _mm256_set_epi32(-hy, -hx, -hy, -hx, -hy, -hx, -hy, -hx);
  const __m128i at_tick = _mm_set1_epi32(static_cast<int>(c.plan.start + static_cast<std::uint32_t>(tick)));
  const __m256d units_per_tick = _mm256_set1_pd(c.plan.units_per_tick);
  std::size_t i = begin;
  for (; i + 4 <= end; i += 4) {
    const auto* ticks = reinterpret_cast<const __m128i*>(trajectories.tick + i);
    const __m256d age = _mm256_cvtepi32_pd(_mm_sub_epi32(at_tick, _mm_loadu_si128(ticks)));
    const __m256d scale = _mm256_mul_pd(units_per_tick, age);
    const __m256 v = _mm256_loadu_ps(&trajectories.velocity[i].x);
    const __m256d first =
        _mm256_mul_pd(_mm256_cvtps_pd(_mm256_castps256_ps128(v)), _mm256_permute4x64_pd(scale, 0x50));
    const __m256d second =
        _mm256_mul_pd(_mm256_cvtps_pd(_mm256_extractf128_ps(v, 1)), _mm256_permute4x64_pd(scale, 0xFA));
    const __m256i moved = _mm256_set_m128i(_mm256_cvtpd_epi32(second), _mm256_cvtpd_epi32(first));
    const __m256i anchor = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(trajectories.anchor + i));
    const __m256i there = _mm256_add_epi32(anchor, moved);
    // In range is -2^29 <= moved < 2^29. A retired parcel, at -2^31, then lies outside the edges as well.
    const __m256i far = _mm256_srli_epi32(_mm256_add_epi32(moved, _mm256_set1_epi32(1 << 29)), 30);
    const __m256i outside = _mm256_or_si256(_mm256_cmpgt_epi32(there, high), _mm256_cmpgt_epi32(low, there));
    if (_mm256_testz_si256(_mm256_or_si256(far, outside), _mm256_set1_epi32(-1)) == 0)
      evaluate_plainly<kBoundary>(c, trajectories, tick, i, i + 4, position);
    else
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(position + i), there);
  }
  evaluate_plainly<kBoundary>(c, trajectories, tick, i, end, position);
}

#endif

template <Boundary kBoundary>
void evaluate(const ExactConstants& c, const TrajectoryArrays& trajectories, std::int32_t tick,
              std::size_t begin, std::size_t end, Vec2i* position) {
#if defined(__x86_64__)
  if (has_avx2()) return evaluate_avx2<kBoundary>(c, trajectories, tick, begin, end, position);
#endif
  evaluate_plainly<kBoundary>(c, trajectories, tick, begin, end, position);
}

}  // namespace

void positions_at(const ExactConstants& c, const TrajectoryArrays& trajectories, std::int32_t tick,
                  std::size_t begin, std::size_t end, Vec2i* position) {
  for_boundary(c.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    evaluate<kBoundary>(c, trajectories, tick, begin, end, position);
  });
}

}  // namespace pf
