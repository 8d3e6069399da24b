// The searches of broad_phase.hpp with AVX2, eight discs at a time.
#if defined(__x86_64__)

#include <immintrin.h>

#include <algorithm>
#include <cmath>

#include "backend/exact/broad_phase_boxes.hpp"
#include "model/for_boundary.hpp"

// Other threads may claim parcels while a search reads their owners: aligned words, which x86 reads whole.
// After a thread has claimed a parcel, its search must see all earlier claims; a locked instruction
// guarantees that. Vector loads cannot be atomic in C++, and the thread sanitizer knows none of this, so it
// skips these searches; the plain search reads owners atomically.
#define PF_AVX2_SEARCH __attribute__((target("avx2"), no_sanitize_thread))
#define PF_AVX2_INLINE __attribute__((target("avx2"), no_sanitize_thread, always_inline)) inline

namespace pf {
namespace {

// One bit for each candidate.
struct CandidateMasks {
  std::uint64_t overlaps, may_touch;
};

// Tests one disc against eight others at a time, first .. first + 7. The result has one bit for each that is
// below last.
template <bool kImages>
struct DiscTest {
  const DiscSpace& space;
  __m256 x, y, radius;

  PF_AVX2_INLINE DiscTest(const DiscSpace& in, const Disc& disc)
      : space(in),
        x(_mm256_set1_ps(disc.x)),
        y(_mm256_set1_ps(disc.y)),
        radius(_mm256_set1_ps(disc.radius)) {}

  PF_AVX2_INLINE static __m256 nearest(__m256 offset, float period) {
    const __m256 periods = _mm256_round_ps(_mm256_mul_ps(offset, _mm256_set1_ps(1.0F / period)),
                                           _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
    return _mm256_sub_ps(offset, _mm256_mul_ps(_mm256_set1_ps(period), periods));
  }
  PF_AVX2_INLINE __m256 distance2(std::uint32_t first) const {
    __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(space.x + first), x);
    __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(space.y + first), y);
    if constexpr (kImages) {
      dx = nearest(dx, period(space.world.half.x));
      dy = nearest(dy, period(space.world.half.y));
    }
    return _mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy));
  }
  PF_AVX2_INLINE static __m256 is_within(__m256 distance2, __m256 radius) {
    return _mm256_cmp_ps(distance2, _mm256_mul_ps(radius, radius), _CMP_LE_OQ);
  }
  PF_AVX2_INLINE __m256 is_overlapping(std::uint32_t first, __m256 distance2) const {
    return is_within(distance2, _mm256_add_ps(radius, _mm256_loadu_ps(space.radius + first)));
  }
  PF_AVX2_INLINE static unsigned below(std::uint32_t first, std::uint32_t last, __m256 mask) {
    const std::uint32_t num = std::min(last - first, 8U);
    return static_cast<unsigned>(_mm256_movemask_ps(mask)) & ((1U << num) - 1U);
  }

  // first <= last
  PF_AVX2_INLINE unsigned overlaps(std::uint32_t first, std::uint32_t last) const {
    return below(first, last, is_overlapping(first, distance2(first)));
  }
  // may_touch: owned parcels whose discs do not overlap this one, but which may touch it.
  PF_AVX2_INLINE CandidateMasks candidates(std::uint32_t first, std::uint32_t last) const {
    const __m256i owner = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(space.owner + first));
    const __m256 is_free = _mm256_castsi256_ps(_mm256_cmpeq_epi32(owner, _mm256_set1_epi32(-1)));
    const __m256 squared = distance2(first);
    const __m256 overlapping = is_overlapping(first, squared);
    const __m256 may_touch = is_within(squared, _mm256_add_ps(radius, _mm256_set1_ps(space.owned_radius)));
    return {below(first, last, overlapping),
            below(first, last, _mm256_andnot_ps(_mm256_or_ps(is_free, overlapping), may_touch))};
  }
};

template <bool kImages>
PF_AVX2_INLINE void append_pairs(const DiscTest<kImages>& test, std::uint32_t i, std::uint32_t first,
                                 std::uint32_t last, DiscPairs& pairs) {
  for (std::uint32_t j = first; j < last; j += 8) {
    for (unsigned mask = test.overlaps(j, last); mask != 0; mask &= mask - 1)
      pairs.candidates.push_back({i, j + static_cast<std::uint32_t>(__builtin_ctz(mask))});
  }
}

template <Boundary kBoundary>
PF_AVX2_SEARCH void append_pairs_by_ranges(const DiscSpace& space, std::uint32_t i, DiscPairs& pairs) {
  const Disc disc = disc_at(space, i);
  if (std::isnan(disc.radius)) return;
  const DiscTest<kBoundary == Boundary::periodic> test(space, disc);
  list_candidates<kBoundary>(space, disc, space.reach, pairs.ranges);
  for (int r = 0; r < pairs.ranges.num; ++r) {
    const auto [first, last] = pairs.ranges.at[r];
    append_pairs(test, i, std::max(first, i + 1), last, pairs);
  }
}

// Cell coordinates of eight positions.
PF_AVX2_INLINE __m256i cell_coordinates(__m256i position, const GridAxis& axis) {
  const __m256i high = _mm256_set1_epi32(axis.high), low = _mm256_set1_epi32(axis.low);
  const __m256i scale = _mm256_set1_epi32(static_cast<int>(axis.factor));
  const __m256i inside = _mm256_max_epi32(_mm256_min_epi32(position, high), low);
  const __m256i offset = _mm256_sub_epi32(inside, low);
  const __m256i even = _mm256_srli_epi64(_mm256_mul_epu32(offset, scale), 32);
  const __m256i odd = _mm256_mul_epu32(_mm256_srli_epi64(offset, 32), scale);
  return _mm256_blend_epi32(even, odd, 0xAA);
}

// Search boxes of eight parcels, in cells.
struct EightBoxes {
  alignas(32) std::int32_t left[8], right[8], top[8];
  // One bit for each parcel that has a disc and whose box crosses no edge of a periodic world.
  unsigned whole;

  template <Boundary kBoundary>
  PF_AVX2_INLINE void set(const DiscSpace& space, std::uint32_t first) {
    const GridShape& grid = space.grid;
    const __m256 radius = _mm256_loadu_ps(space.radius + first);
    const __m256i x = _mm256_cvttps_epi32(_mm256_loadu_ps(space.x + first));
    const __m256i y = _mm256_cvttps_epi32(_mm256_loadu_ps(space.y + first));
    const __m256i reach = _mm256_add_epi32(_mm256_cvttps_epi32(radius), _mm256_set1_epi32(space.reach));
    _mm256_store_si256(reinterpret_cast<__m256i*>(left),
                       cell_coordinates(_mm256_sub_epi32(x, reach), grid.x));
    _mm256_store_si256(reinterpret_cast<__m256i*>(right),
                       cell_coordinates(_mm256_add_epi32(x, reach), grid.x));
    _mm256_store_si256(reinterpret_cast<__m256i*>(top), cell_coordinates(_mm256_add_epi32(y, reach), grid.y));
    __m256 is_whole = _mm256_cmp_ps(radius, radius, _CMP_ORD_Q);
    if constexpr (kBoundary == Boundary::periodic) {
      const __m256i room =
          _mm256_min_epi32(_mm256_sub_epi32(_mm256_set1_epi32(grid.x.half), _mm256_abs_epi32(x)),
                           _mm256_sub_epi32(_mm256_set1_epi32(grid.y.half), _mm256_abs_epi32(y)));
      is_whole = _mm256_and_ps(is_whole, _mm256_castsi256_ps(_mm256_cmpgt_epi32(room, reach)));
    }
    whole = static_cast<unsigned>(_mm256_movemask_ps(is_whole));
  }
};

// Cells of a search box that hold parcels of higher index: the rest of the parcel's own row, and rows above.
struct CellBox {
  const std::uint32_t* starts;  // cell_start of the parcel's row
  std::int32_t left, right;     // columns
  std::int32_t num_above;       // rows; may be negative
};

PF_AVX2_SEARCH __attribute__((noinline)) void append_rows(const DiscSpace& space, std::uint32_t i,
                                                          CellBox box, DiscPairs& pairs) {
  const DiscTest<false> test(space, disc_at(space, i));
  append_pairs(test, i, i + 1, box.starts[box.right + 1], pairs);
  for (; box.num_above > 0; --box.num_above) {
    box.starts += space.grid.x.num;
    append_pairs(test, i, box.starts[box.left], box.starts[box.right + 1], pairs);
  }
}

// Overlaps of parcel i: one bit for each of eight candidates from i + 1 on, and of eight from first_above on.
struct OverlapMask {
  std::uint32_t i, first_above;
  unsigned mask;
};

void append_overlaps(const OverlapMask& overlaps, DiscPairs& pairs) {
  const std::uint32_t i = overlaps.i;
  for (unsigned mask = overlaps.mask; mask != 0; mask &= mask - 1) {
    const auto bit = static_cast<std::uint32_t>(__builtin_ctz(mask));
    pairs.candidates.push_back({i, bit < 8 ? i + 1 + bit : overlaps.first_above + (bit - 8)});
  }
}

// Nearly all boxes have two rows of at most eight candidates each. The processor cannot predict which boxes
// contain an overlap, so there is no branch on that.
template <Boundary kBoundary>
PF_AVX2_SEARCH void find_pairs_avx2(const DiscSpace& space, std::uint32_t begin, std::uint32_t end,
                                    DiscPairs& pairs) {
  pairs.candidates.clear();
  if (space.all_pairs) {
    for (std::uint32_t i = begin; i < end; ++i) append_pairs_by_ranges<kBoundary>(space, i, pairs);
    return;
  }
  const GridShape& grid = space.grid;
  const std::uint32_t* starts = space.cell_start;
  end = std::min(end, starts[grid.num_cells()]);  // retired parcels come after them
  const auto cell = std::upper_bound(starts, starts + grid.num_cells() + 1, begin) - starts - 1;
  std::int32_t row = static_cast<std::int32_t>(cell) / grid.x.num;
  starts += static_cast<std::ptrdiff_t>(row) * grid.x.num;
  EightBoxes boxes;
  OverlapMask found[9];  // eight, and one that is written before it is known to be empty
  for (std::uint32_t first = begin; first < end; first += 8) {
    boxes.set<kBoundary>(space, first);
    const std::uint32_t num = std::min(end - first, 8U);
    unsigned num_found = 0;
    for (std::uint32_t k = 0; k < num; ++k) {
      const std::uint32_t i = first + k;
      if ((boxes.whole >> k & 1U) == 0) {
        append_pairs_by_ranges<kBoundary>(space, i, pairs);
        continue;
      }
      for (; starts[grid.x.num] <= i; starts += grid.x.num) ++row;
      const std::int32_t left = boxes.left[k], right = boxes.right[k], num_above = boxes.top[k] - row;
      const std::uint32_t* above = starts + (num_above > 0 ? grid.x.num : 0);
      const std::uint32_t last = std::max(starts[right + 1], i + 1);
      const std::uint32_t first_above = above[left], end_above = above[right + 1];
      const std::uint32_t last_above = num_above > 0 ? end_above : first_above;
      if (num_above > 1 || last - (i + 1) > 8 || last_above - first_above > 8) {
        append_rows(space, i, {starts, left, right, num_above}, pairs);
        continue;
      }
      const DiscTest<false> test(space, disc_at(space, i));
      found[num_found] = {i, first_above,
                          test.overlaps(i + 1, last) | test.overlaps(first_above, last_above) << 8};
      num_found += found[num_found].mask != 0 ? 1 : 0;
    }
    for (unsigned k = 0; k < num_found; ++k) append_overlaps(found[k], pairs);
  }
}

// Blocks of up to eight candidates with consecutive indices. There are always kFew blocks to read; unused
// ones are empty.
struct Blocks {
  static constexpr unsigned kFew = 4, kMax = 8;
  std::uint32_t first[kMax + 3], last[kMax + 3];
  unsigned num = 0;  // above kMax: some blocks are missing

  Blocks() {
    for (unsigned k = 0; k < kFew; ++k) first[k] = last[k] = 0;
  }
  // Has no branch on the number of blocks.
  void add(std::uint32_t begin, std::uint32_t end) {
    const unsigned at = std::min(num, kMax);
    for (unsigned k = 0; k < 3; ++k) {
      first[at + k] = std::min(begin + 8 * k, end);
      last[at + k] = end;
    }
    num += (end - begin + 7) / 8 + (end - begin > 24 ? kMax : 0);
  }
};

void append(std::uint64_t mask, const std::uint32_t* first, std::uint32_t self,
            std::vector<std::uint32_t>& parcels) {
  for (; mask != 0; mask &= mask - 1) {
    const auto bit = static_cast<unsigned>(__builtin_ctzll(mask));
    const std::uint32_t j = first[bit / 8] + bit % 8;
    if (j != self) parcels.push_back(j);
  }
}

template <bool kImages>
PF_AVX2_INLINE void append_candidates(const DiscTest<kImages>& test, const std::uint32_t* first,
                                      const std::uint32_t* last, unsigned num, std::uint32_t self,
                                      Candidates& candidates) {
  CandidateMasks all{};
  for (unsigned k = 0; k < num; ++k) {
    const CandidateMasks some = test.candidates(first[k], last[k]);
    all.overlaps |= some.overlaps << (8 * k);
    all.may_touch |= some.may_touch << (8 * k);
  }
  append(all.overlaps, first, self, candidates.overlapping);
  append(all.may_touch, first, self, candidates.owned);
}

template <Boundary kBoundary>
PF_AVX2_SEARCH void find_candidates_by_ranges(const DiscSpace& space, const Mover& mover,
                                              Candidates& candidates) {
  const DiscTest<kBoundary == Boundary::periodic> test(space, mover.disc);
  list_candidates<kBoundary>(space, mover.disc, space.reach_owned, candidates.ranges);
  for (int r = 0; r < candidates.ranges.num; ++r) {
    const auto [first, last] = candidates.ranges.at[r];
    for (std::uint32_t j = first; j < last; j += 8)
      append_candidates(test, &j, &last, 1, mover.index, candidates);
  }
}

// Gathers the candidates of kNum movers that share a box. Returns false if the box crosses an edge of a
// periodic world, has more than three rows of cells, or has too many candidates; all of these are rare.
template <Boundary kBoundary, unsigned kNum>
bool gather_blocks(const DiscSpace& space, const Mover* movers, Blocks& blocks) {
  const GridShape& grid = space.grid;
  if (space.all_pairs) return false;
  Vec2i low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};
  for (unsigned k = 0; k < kNum; ++k) {
    const Vec2i centre = centre_of(movers[k].disc);
    const std::int32_t reach = half_side_of_box(movers[k].disc, space.reach_owned);
    if (kBoundary == Boundary::periodic && !is_far_from_edge(space.world, centre, reach)) return false;
    low = {std::min(low.x, centre.x - reach), std::min(low.y, centre.y - reach)};
    high = {std::max(high.x, centre.x + reach), std::max(high.y, centre.y + reach)};
  }
  const std::int32_t left = cell_coordinate(low.x, grid.x);
  const std::int32_t right = cell_coordinate(high.x, grid.x);
  const std::int32_t bottom = cell_coordinate(low.y, grid.y);
  const std::int32_t top = cell_coordinate(high.y, grid.y);
  for (std::int32_t k = 0; k < 3; ++k) {
    const std::int32_t row = std::min(bottom + k, top);
    const std::uint32_t* starts = space.cell_start + static_cast<std::uint32_t>(row) * grid.x.num;
    const std::uint32_t first = starts[left], count = starts[right + 1] - first;
    blocks.add(first, first + (bottom + k <= top ? count : 0));
  }
  return top - bottom <= 2 && blocks.num <= Blocks::kMax;
}

template <Boundary kBoundary, unsigned kNum>
PF_AVX2_SEARCH void find_candidates_avx2(const DiscSpace& space, const Mover* movers,
                                         Candidates* candidates) {
  for (unsigned k = 0; k < kNum; ++k) {
    candidates[k].overlapping.clear();
    candidates[k].owned.clear();
  }
  Blocks blocks;
  const bool gathered = gather_blocks<kBoundary, kNum>(space, movers, blocks);
  for (unsigned k = 0; k < kNum; ++k) {
    if (!gathered) {
      find_candidates_by_ranges<kBoundary>(space, movers[k], candidates[k]);
      continue;
    }
    const DiscTest<false> test(space, movers[k].disc);
    if (blocks.num <= Blocks::kFew)
      append_candidates(test, blocks.first, blocks.last, Blocks::kFew, movers[k].index, candidates[k]);
    else
      append_candidates(test, blocks.first, blocks.last, blocks.num, movers[k].index, candidates[k]);
  }
}

template <Boundary kBoundary>
void find_candidates_avx2(const DiscSpace& space, const Mover& mover, Candidates& candidates) {
  find_candidates_avx2<kBoundary, 1>(space, &mover, &candidates);
}
template <Boundary kBoundary>
void find_candidates_of_two_avx2(const DiscSpace& space, const Mover (&movers)[2],
                                 Candidates (&candidates)[2]) {
  find_candidates_avx2<kBoundary, 2>(space, movers, candidates);
}

}  // namespace

DiscSearch avx2_disc_search(Boundary boundary) {
  return for_boundary(boundary, []<Boundary kBoundary>() {
    return DiscSearch{find_pairs_avx2<kBoundary>, find_candidates_avx2<kBoundary>,
                      find_candidates_of_two_avx2<kBoundary>};
  });
}

}  // namespace pf

#endif
