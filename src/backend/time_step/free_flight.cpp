#include "backend/time_step/free_flight.hpp"

#include <algorithm>
#include <cmath>

#include "backend/avx2.hpp"
#include "core/random.hpp"
#include "model/for_boundary.hpp"

namespace pf {

#if defined(__x86_64__)

namespace {

#define PF_VECTOR __attribute__((PF_AVX2, always_inline)) inline

// Bound on the reach of a ball, so that sums of it and a displacement fit 32 bits.
constexpr std::int32_t kMaxBallReach = 1 << 29;

PF_VECTOR __m256i mix32(__m256i z) {
  z = _mm256_mullo_epi32(_mm256_xor_si256(z, _mm256_srli_epi32(z, 16)), _mm256_set1_epi32(0x7FEB352D));
  z = _mm256_mullo_epi32(_mm256_xor_si256(z, _mm256_srli_epi32(z, 15)),
                         _mm256_set1_epi32(static_cast<std::int32_t>(0x846CA68BU)));
  return _mm256_xor_si256(z, _mm256_srli_epi32(z, 16));
}

// ORs the flags of the two elements of each pair.
PF_VECTOR __m256i either(__m256i flags) { return _mm256_or_si256(flags, _mm256_shuffle_epi32(flags, 0xB1)); }

PF_VECTOR __m256i pairs_of(Vec2i v) { return _mm256_set1_epi64x(bit_copy<long long>(v)); }

// Constants of the loop, in every lane.
struct Lanes {
  __m256 advance, advance_rest;  // position units per (m/s)
  __m256 max_velocity;           // along an axis
  __m256i step_key;
  __m256i highest, lowest;  // positions that the boundary does not act on
  __m256i ball, ball_reach, half, period;
  __m128i rough_shift;
};

// Velocity along an axis, m/s, up to which a step is finite and shorter than 2^30 units.
float max_velocity(const StepConstants& c) {
  const double by_step = 0x1p30 * 0x1p32 / c.advance_scale;
  return static_cast<float>(0.99 * std::min(by_step, std::sqrt(0.5 * static_cast<double>(kMaxFiniteSpeed2))));
}

// The highest coordinate; below the lowest one if there is none.
std::int32_t last_of(const InsideRange& range) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(range.low) + range.num - 1U);
}

__attribute__((PF_AVX2)) Lanes make_lanes(const FreeFlightInput& in) {
  const StepConstants& c = in.constants;
  const Vec2i half = c.physics.world.half;
  return {_mm256_set1_ps(c.advance),
          _mm256_set1_ps(c.advance_rest),
          _mm256_set1_ps(max_velocity(c)),
          _mm256_set1_epi32(static_cast<std::int32_t>(in.step_key)),
          pairs_of({last_of(c.inside_x), last_of(c.inside_y)}),
          pairs_of({c.inside_x.low, c.inside_y.low}),
          pairs_of(in.ball.centre),
          _mm256_set1_epi32(std::min(in.ball.reach, kMaxBallReach) + 4),
          pairs_of(half),
          _mm256_slli_epi32(pairs_of(half), 1),
          _mm_cvtsi32_si128(in.rough_shift)};
}

// displacement() of model/time_step.hpp for four parcels. random: the mixed id of each, twice.
PF_VECTOR __m256i displacement(const Lanes& c, __m256 velocity, __m256i random) {
  const __m256 moved = _mm256_mul_ps(velocity, c.advance);
  const __m256i whole = _mm256_cvtps_epi32(moved);
  const __m256 lost =
      _mm256_add_ps(_mm256_fmsub_ps(velocity, c.advance, moved), _mm256_mul_ps(velocity, c.advance_rest));
  const __m256 rest = _mm256_add_ps(_mm256_sub_ps(moved, _mm256_cvtepi32_ps(whole)), lost);
  const __m256i counts = _mm256_cvtps_epi32(_mm256_mul_ps(rest, _mm256_set1_ps(65536.0F)));
  const __m256i bits = _mm256_blend_epi16(_mm256_srli_epi32(random, 16), random, 0x44);
  return _mm256_add_epi32(whole, _mm256_srai_epi32(_mm256_add_epi32(counts, bits), 16));
}

// Moves four parcels and returns the magnitude of their displacements. Adds to `others` those whose step is
// not done: their state is as before.
template <bool kBall, Boundary kBoundary>
PF_VECTOR __m256i fly(const Lanes& c, const FreeFlightInput& in, std::size_t i, __m256i random,
                      std::vector<std::uint32_t>& others) {
  const __m256 velocity = _mm256_loadu_ps(&in.velocity[i].x), sign = _mm256_set1_ps(-0.0F);
  const __m256i moved = displacement(c, velocity, random);
  auto* const at = reinterpret_cast<__m256i*>(in.position + i);
  const __m256i before = _mm256_loadu_si256(at);
  __m256i after = _mm256_add_epi32(before, moved), magnitude = _mm256_abs_epi32(moved);

  // A negative zero becomes a positive one, as if an empty sum were added.
  __m256i is_other = _mm256_cmpeq_epi32(_mm256_castps_si256(velocity), _mm256_castps_si256(sign));
  is_other = _mm256_or_si256(is_other, _mm256_castps_si256(_mm256_cmp_ps(_mm256_andnot_ps(sign, velocity),
                                                                         c.max_velocity, _CMP_NLT_UQ)));
  is_other = _mm256_or_si256(is_other, _mm256_cmpgt_epi32(after, c.highest));
  is_other = _mm256_or_si256(is_other, _mm256_cmpgt_epi32(c.lowest, after));
  if constexpr (kBall) {
    const __m256i near = nearest_image<kBoundary>(_mm256_sub_epi32(before, c.ball), c.half, c.period);
    const __m256i is_far =
        either(_mm256_cmpgt_epi32(_mm256_abs_epi32(near), _mm256_add_epi32(c.ball_reach, magnitude)));
    is_other = _mm256_or_si256(is_other, _mm256_xor_si256(is_far, _mm256_set1_epi32(-1)));
  }
  if (_mm256_movemask_epi8(is_other) != 0) {
    is_other = either(is_other);
    after = _mm256_blendv_epi8(after, before, is_other);
    magnitude = _mm256_andnot_si256(is_other, magnitude);
    auto bits = static_cast<unsigned>(_mm256_movemask_pd(_mm256_castsi256_pd(is_other)));
    for (; bits != 0; bits &= bits - 1)
      others.push_back(static_cast<std::uint32_t>(i) + static_cast<unsigned>(__builtin_ctz(bits)));
  }
  _mm256_storeu_si256(at, after);
  const char z = -1;
  const __m256i low_halves =
      _mm256_broadcastsi128_si256(_mm_set_epi8(z, z, z, z, z, z, z, z, 13, 12, 9, 8, 5, 4, 1, 0));
  const __m256i rough = _mm256_shuffle_epi8(_mm256_sra_epi32(after, c.rough_shift), low_halves);
  _mm_storeu_si128(reinterpret_cast<__m128i*>(in.rough + i),
                   _mm256_castsi256_si128(_mm256_permute4x64_epi64(rough, 0x08)));
  return magnitude;
}

template <bool kBall, Boundary kBoundary>
__attribute__((PF_AVX2)) void fly_range(const FreeFlightInput& in, std::size_t begin, std::size_t end,
                                        FreeFlights& result) {
  constexpr std::size_t kAhead = 1024;  // parcels: they are searched before they move
  const Lanes lanes = make_lanes(in);
  __m256i max_displacement = _mm256_setzero_si256();
  const std::size_t whole = kBall && in.ball.reach > kMaxBallReach ? begin : end - (end - begin) % 8;
  for (std::size_t i = begin; i < whole; i += 8) {
    __builtin_prefetch(in.position + i + kAhead);
    __builtin_prefetch(in.velocity + i + kAhead);
    __builtin_prefetch(in.id + i + kAhead);
    const __m256i ids = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(in.id + i));
    const __m256i random = mix32(_mm256_xor_si256(ids, lanes.step_key));
    const __m256i of_first = _mm256_permutevar8x32_epi32(random, _mm256_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3)),
                  of_last = _mm256_permutevar8x32_epi32(random, _mm256_setr_epi32(4, 4, 5, 5, 6, 6, 7, 7));
    const __m256i first = fly<kBall, kBoundary>(lanes, in, i, of_first, result.others),
                  last = fly<kBall, kBoundary>(lanes, in, i + 4, of_last, result.others);
    max_displacement = _mm256_max_epi32(max_displacement, _mm256_max_epi32(first, last));
  }
  for (std::size_t i = whole; i < end; ++i) result.others.push_back(static_cast<std::uint32_t>(i));
  alignas(32) std::int32_t displacements[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(displacements), max_displacement);
  result.max_displacement = *std::max_element(displacements, displacements + 8);
}

#undef PF_VECTOR

}  // namespace

FreeFlight choose_free_flight(bool has_ball, Boundary boundary) {
  if (!has_avx2()) return nullptr;
  return for_boundary(boundary, [&]<Boundary kBoundary>() -> FreeFlight {
    return has_ball ? fly_range<true, kBoundary> : fly_range<false, kBoundary>;
  });
}

#else

FreeFlight choose_free_flight(bool, Boundary) { return nullptr; }

#endif

}  // namespace pf
