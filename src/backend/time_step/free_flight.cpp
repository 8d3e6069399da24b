#include "backend/time_step/free_flight.hpp"

#include <algorithm>

#include "backend/avx2.hpp"
#include "core/random.hpp"
#include "model/for_boundary.hpp"

namespace pf {

#if defined(__x86_64__)

namespace {

#define PF_VECTOR __attribute__((PF_AVX2, always_inline)) inline

// Bound on the reach of a ball, so that sums of it and a displacement fit 32 bits.
constexpr std::int32_t kMaxReach = 1 << 29;

// Adding this to a number of magnitude below 2^51 leaves its nearest integer, ties to even, in the low bits.
constexpr double kRounder = 6755399441055744.0;  // 1.5 * 2^52

PF_VECTOR __m256i low_integer(__m256d value) {
  const __m256d rounder = _mm256_set1_pd(kRounder);
  return _mm256_sub_epi64(_mm256_castpd_si256(_mm256_add_pd(value, rounder)), _mm256_castpd_si256(rounder));
}

// Nearest multiple of 2^32, over 2^32.
PF_VECTOR __m256d high_part(__m256d value) {
  return _mm256_round_pd(_mm256_mul_pd(value, _mm256_set1_pd(0x1p-32)),
                         _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}

// round_to_int64 where |high| < 2^30. The rest, at most 2^31, is exact.
PF_VECTOR __m256i round_to_fixed(__m256d value, __m256d high) {
  const __m256d rest = _mm256_sub_pd(value, _mm256_mul_pd(high, _mm256_set1_pd(0x1p32)));
  return _mm256_add_epi64(_mm256_slli_epi64(low_integer(high), 32), low_integer(rest));
}

PF_VECTOR __m256d is_small(__m256d high) {
  return _mm256_cmp_pd(_mm256_andnot_pd(_mm256_set1_pd(-0.0), high), _mm256_set1_pd(0x1p30 - 2.0),
                       _CMP_LT_OQ);
}

// The upper 32 bits of eight 64-bit integers, in order.
PF_VECTOR __m256i upper_halves(__m256i a, __m256i b) {
  const __m256 mixed = _mm256_shuffle_ps(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b), 0xDD);
  return _mm256_permute4x64_epi64(_mm256_castps_si256(mixed), 0xD8);
}

PF_VECTOR __m128i mix32(__m128i z) {
  z = _mm_mullo_epi32(_mm_xor_si128(z, _mm_srli_epi32(z, 16)), _mm_set1_epi32(0x7FEB352D));
  z = _mm_mullo_epi32(_mm_xor_si128(z, _mm_srli_epi32(z, 15)),
                      _mm_set1_epi32(static_cast<std::int32_t>(0x846CA68BU)));
  return _mm_xor_si128(z, _mm_srli_epi32(z, 16));
}

// For either element of a pair: what it has, or what its twin has.
PF_VECTOR __m256i either(__m256i flags) { return _mm256_or_si256(flags, _mm256_shuffle_epi32(flags, 0xB1)); }

PF_VECTOR __m256i pairs_of(Vec2i v) { return _mm256_set1_epi64x(bit_copy<long long>(v)); }

// Constants of the loop, in every lane.
struct Lanes {
  __m256d advance_scale;
  __m128i step_key;
  __m256i highest, lowest;  // positions that the boundary does not act on
  __m256i ball, ball_reach, half, period;
};

template <Boundary kBoundary>
__attribute__((PF_AVX2)) Lanes make_lanes(const FreeFlightInput& in) {
  const StepConstants& c = in.constants;
  const Vec2i half = c.physics.world.half;
  const std::int32_t margin = kBoundary == Boundary::walls ? c.contact_reach / 2 : 0;
  const std::int32_t last = kBoundary == Boundary::periodic ? 1 : margin;
  return {_mm256_set1_pd(c.advance_scale),
          _mm_set1_epi32(static_cast<std::int32_t>(in.step_key)),
          pairs_of({half.x - last, half.y - last}),
          pairs_of({margin - half.x, margin - half.y}),
          pairs_of(in.ball.centre),
          _mm256_set1_epi32(std::min(in.ball.reach, kMaxReach) + 4),
          pairs_of(half),
          _mm256_slli_epi32(pairs_of(half), 1)};
}

// The random bits of round_at_random for two parcels: 16 for x, 16 for y, times 2^16, plus half of that.
// random: one number for both elements of a pair.
PF_VECTOR __m256i rounding_of(__m256i random) {
  const __m256i in_place = _mm256_sllv_epi64(random, _mm256_set_epi64x(16, 0, 16, 0));
  return _mm256_or_si256(_mm256_and_si256(in_place, _mm256_set1_epi64x(0xFFFF0000)),
                         _mm256_set1_epi64x(32768));
}

// Four parcels. Pairs of lanes hold x and y.
struct Four {
  __m256i position;
  __m256 velocity, speed2;
  __m256i displacement;  // magnitude
  __m256i is_other;      // the step of this parcel is not done
};

template <bool kBall, Boundary kBoundary>
PF_VECTOR Four fly(const Lanes& c, const FreeFlightInput& in, std::size_t i) {
  Four four;
  // Adding zero makes a positive zero of a negative one, as adding an empty sum does.
  four.velocity = _mm256_add_ps(_mm256_loadu_ps(&in.velocity[i].x), _mm256_setzero_ps());
  const __m256d a = _mm256_mul_pd(_mm256_cvtps_pd(_mm256_castps256_ps128(four.velocity)), c.advance_scale);
  const __m256d b = _mm256_mul_pd(_mm256_cvtps_pd(_mm256_extractf128_ps(four.velocity, 1)), c.advance_scale);
  const __m256d high_a = high_part(a), high_b = high_part(b);

  const auto* ids = reinterpret_cast<const __m128i*>(in.id + i);
  const __m256i random = _mm256_cvtepu32_epi64(mix32(_mm_xor_si128(_mm_loadu_si128(ids), c.step_key)));
  const __m256i fixed_a =
      _mm256_add_epi64(round_to_fixed(a, high_a), rounding_of(_mm256_permute4x64_epi64(random, 0x50)));
  const __m256i fixed_b =
      _mm256_add_epi64(round_to_fixed(b, high_b), rounding_of(_mm256_permute4x64_epi64(random, 0xFA)));
  const __m256i moved = upper_halves(fixed_a, fixed_b);
  four.displacement = _mm256_abs_epi32(moved);
  const __m256i before = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(in.position + i));
  four.position = _mm256_add_epi32(before, moved);
  const __m256 squared = _mm256_mul_ps(four.velocity, four.velocity);
  four.speed2 = _mm256_add_ps(squared, _mm256_shuffle_ps(squared, squared, 0xB1));

  const __m256i is_free =
      upper_halves(_mm256_castpd_si256(is_small(high_a)), _mm256_castpd_si256(is_small(high_b)));
  const __m256 is_finite = _mm256_cmp_ps(four.speed2, _mm256_set1_ps(kMaxFiniteSpeed2), _CMP_LT_OQ);
  const __m256i all_set = _mm256_set1_epi32(-1);
  __m256i other = _mm256_xor_si256(_mm256_and_si256(is_free, _mm256_castps_si256(is_finite)), all_set);
  other = _mm256_or_si256(other, _mm256_cmpgt_epi32(four.position, c.highest));
  other = either(_mm256_or_si256(other, _mm256_cmpgt_epi32(c.lowest, four.position)));
  const auto* contacts = reinterpret_cast<const __m128i*>(in.contacts + i);
  const __m128i untouched = _mm_cmpeq_epi32(_mm_loadu_si128(contacts), _mm_setzero_si128());
  other = _mm256_or_si256(other, _mm256_xor_si256(_mm256_cvtepi32_epi64(untouched), all_set));
  if constexpr (kBall) {
    const __m256i near = nearest_image<kBoundary>(_mm256_sub_epi32(before, c.ball), c.half, c.period);
    const __m256i reach = _mm256_add_epi32(c.ball_reach, four.displacement);
    const __m256i is_far = either(_mm256_cmpgt_epi32(_mm256_abs_epi32(near), reach));
    other = _mm256_or_si256(other, _mm256_xor_si256(is_far, all_set));
  }
  four.is_other = other;
  return four;
}

template <bool kBall, Boundary kBoundary>
__attribute__((PF_AVX2)) void fly_range(const FreeFlightInput& in, std::size_t begin, std::size_t end,
                                        FreeFlights& result) {
  const Lanes lanes = make_lanes<kBoundary>(in);
  __m256i max_displacement = _mm256_setzero_si256();
  __m256 max_speed2 = _mm256_setzero_ps();
  const __m128i rough_shift = _mm_cvtsi32_si128(in.rough_shift);
  const __m256i low_halves =
      _mm256_broadcastsi128_si256(_mm_set_epi8(-1, -1, -1, -1, -1, -1, -1, -1, 13, 12, 9, 8, 5, 4, 1, 0));
  const std::size_t whole = kBall && in.ball.reach > kMaxReach ? begin : end - (end - begin) % 4;
  for (std::size_t i = begin; i < whole; i += 4) {
    const Four four = fly<kBall, kBoundary>(lanes, in, i);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(in.next_position + i), four.position);
    _mm256_storeu_ps(&in.next_velocity[i].x, four.velocity);
    const __m256i rough = _mm256_shuffle_epi8(_mm256_sra_epi32(four.position, rough_shift), low_halves);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(in.next_rough + i),
                     _mm256_castsi256_si128(_mm256_permute4x64_epi64(rough, 0x08)));
    max_displacement =
        _mm256_max_epi32(max_displacement, _mm256_andnot_si256(four.is_other, four.displacement));
    max_speed2 = _mm256_max_ps(max_speed2, _mm256_andnot_ps(_mm256_castsi256_ps(four.is_other), four.speed2));
    auto others = static_cast<unsigned>(_mm256_movemask_pd(_mm256_castsi256_pd(four.is_other)));
    for (; others != 0; others &= others - 1)
      result.others.push_back(static_cast<std::uint32_t>(i) + static_cast<unsigned>(__builtin_ctz(others)));
  }
  for (std::size_t i = whole; i < end; ++i) result.others.push_back(static_cast<std::uint32_t>(i));
  alignas(32) std::int32_t displacements[8];
  alignas(32) float speeds[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(displacements), max_displacement);
  _mm256_store_ps(speeds, max_speed2);
  result.max_displacement = *std::max_element(displacements, displacements + 8);
  result.max_speed2 = *std::max_element(speeds, speeds + 8);
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
