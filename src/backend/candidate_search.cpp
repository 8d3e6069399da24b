#include "backend/candidate_search.hpp"

#include <algorithm>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace pf {
namespace {

// Lists the contiguous ranges of candidates. (A function object called for each would not have the target
// attribute of the search that makes it.)
template <Boundary kBoundary>
inline void list_ranges(const SearchSpace& space, Vec2i here, SearchScratch& scratch) {
  int num = 0;
  if (!space.all_pairs) {
    visit_candidate_ranges<kBoundary>(space.grid, space.cell_start, here, space.reach,
                                      [&](std::uint32_t first, std::uint32_t last) {
                                        if (num < SearchScratch::kMostRanges)
                                          scratch.ranges[num] = {first, last};
                                        ++num;
                                      });
  }
  if (space.all_pairs || num > SearchScratch::kMostRanges) {  // or a box of very many rows
    scratch.ranges[0] = {0, space.num_parcels};
    num = 1;
  }
  scratch.num_ranges = num;
}

template <Boundary kBoundary>
void search_plainly(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch) {
  const Vec2i here = space.position[i];
  list_ranges<kBoundary>(space, here, scratch);
  scratch.finds.clear();
  for (int r = 0; r < scratch.num_ranges; ++r) {
    for (std::uint32_t j = scratch.ranges[r].first; j < scratch.ranges[r].last; ++j) {
      const Vec2i offset = separation<kBoundary>(space.world, here, space.position[j]);
      const float x = static_cast<float>(offset.x);
      const float y = static_cast<float>(offset.y);
      if ((x * x + y * y < space.filter_distance2) & (j != i)) scratch.finds.push_back(j);
    }
  }
}

#if defined(__x86_64__)

// Nearest image of eight differences, lanes alternating x and y.
template <Boundary kBoundary>
__attribute__((target("avx2"), always_inline)) inline __m256i nearest_image(__m256i d, __m256i half,
                                                                            __m256i period) {
  if constexpr (kBoundary == Boundary::periodic) {
    const __m256i too_high = _mm256_cmpgt_epi32(d, _mm256_sub_epi32(half, _mm256_set1_epi32(1)));
    const __m256i too_low = _mm256_cmpgt_epi32(_mm256_sub_epi32(_mm256_setzero_si256(), half), d);
    d = _mm256_sub_epi32(d, _mm256_and_si256(too_high, period));
    d = _mm256_add_epi32(d, _mm256_and_si256(too_low, period));
  }
  return d;
}

// What the eight-wide filter compares with, one parcel's.
template <Boundary kBoundary>
struct Filter {
  __m256i centre, half, period, self;
  __m256 distance2;

  // Which of the parcels first .. first + 7 are below last, near, and not self; a bit each, in the order of
  // kOrder.
  __attribute__((target("avx2"), always_inline)) unsigned near(const SearchSpace& space, std::uint32_t first,
                                                               std::uint32_t last) const {
    const auto* from = reinterpret_cast<const __m256i*>(space.position + first);
    const __m256i a =
        nearest_image<kBoundary>(_mm256_sub_epi32(_mm256_loadu_si256(from), centre), half, period);
    const __m256i b =
        nearest_image<kBoundary>(_mm256_sub_epi32(_mm256_loadu_si256(from + 1), centre), half, period);
    const __m256 fa = _mm256_cvtepi32_ps(a);
    const __m256 fb = _mm256_cvtepi32_ps(b);
    const __m256 squared = _mm256_hadd_ps(_mm256_mul_ps(fa, fa), _mm256_mul_ps(fb, fb));
    const __m256i order = _mm256_set_epi32(7, 6, 3, 2, 5, 4, 1, 0);
    const __m256i index = _mm256_add_epi32(order, _mm256_set1_epi32(static_cast<int>(first)));
    const __m256i inside = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(last)), index);
    const __m256i wanted = _mm256_andnot_si256(_mm256_cmpeq_epi32(index, self), inside);
    const __m256 found =
        _mm256_and_ps(_mm256_cmp_ps(squared, distance2, _CMP_LT_OQ), _mm256_castsi256_ps(wanted));
    return static_cast<unsigned>(_mm256_movemask_ps(found));
  }
};

// The horizontal add leaves the eight candidates in this order.
constexpr std::uint32_t kOrder[8] = {0, 1, 4, 5, 2, 3, 6, 7};

inline void take(unsigned mask, std::uint32_t first, std::vector<std::uint32_t>& finds) {
  for (; mask != 0; mask &= mask - 1) finds.push_back(first + kOrder[__builtin_ctz(mask)]);
}

// Eight candidates at a time. A box of at most three rows, as nearly all are, goes without a branch on how
// many rows and parcels there are: these differ from parcel to parcel and would be mispredicted.
template <Boundary kBoundary>
__attribute__((target("avx2"))) void search_avx2(const SearchSpace& space, std::uint32_t i,
                                                 SearchScratch& scratch) {
  const Vec2i here = space.position[i];
  const int hx = space.world.half.x, hy = space.world.half.y;
  Filter<kBoundary> filter;
  filter.centre = _mm256_set1_epi64x(bit_copy<long long>(here));
  filter.half = _mm256_set_epi32(hy, hx, hy, hx, hy, hx, hy, hx);
  filter.period = _mm256_slli_epi32(filter.half, 1);
  filter.self = _mm256_set1_epi32(static_cast<int>(i));
  filter.distance2 = _mm256_set1_ps(space.filter_distance2);
  scratch.finds.clear();

  const GridShape& grid = space.grid;
  const CellSpan sx = cell_span<kBoundary>(here.x, space.reach, grid.half.x, grid.num_x, grid.factor_x);
  const CellSpan sy = cell_span<kBoundary>(here.y, space.reach, grid.half.y, grid.num_y, grid.factor_y);
  const bool whole = sx.second_first > sx.second_last && sy.second_first > sy.second_last;
  if (!space.all_pairs && whole && sy.last - sy.first <= 2) {
    std::uint32_t first[3], last[3];
    unsigned mask[3];
    for (int k = 0; k < 3; ++k) {
      const std::int32_t row = std::min(sy.first + k, sy.last);
      const std::uint32_t* starts = space.cell_start + static_cast<std::uint32_t>(row) * grid.num_x;
      first[k] = starts[sx.first];
      last[k] = sy.first + k <= sy.last ? starts[sx.last + 1] : first[k];
      mask[k] = filter.near(space, first[k], last[k]);
    }
    const bool more = last[0] - first[0] > 8 || last[1] - first[1] > 8 || last[2] - first[2] > 8;
    if (!more && (mask[0] | mask[1] | mask[2]) == 0) return;
    for (int k = 0; k < 3; ++k) {
      take(mask[k], first[k], scratch.finds);
      for (std::uint32_t j = first[k] + 8; j < last[k]; j += 8)
        take(filter.near(space, j, last[k]), j, scratch.finds);
    }
    return;
  }
  list_ranges<kBoundary>(space, here, scratch);
  for (int r = 0; r < scratch.num_ranges; ++r) {
    const auto [first, last] = scratch.ranges[r];
    for (std::uint32_t j = first; j < last; j += 8) take(filter.near(space, j, last), j, scratch.finds);
  }
}

#endif

template <Boundary kBoundary>
Search fastest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return search_avx2<kBoundary>;
#endif
  return search_plainly<kBoundary>;
}

}  // namespace

Search plain_search(Boundary boundary) {
  switch (boundary) {
    case Boundary::walls:
      return search_plainly<Boundary::walls>;
    case Boundary::periodic:
      return search_plainly<Boundary::periodic>;
    default:
      return search_plainly<Boundary::open>;
  }
}

Search choose_search(Boundary boundary) {
  switch (boundary) {
    case Boundary::walls:
      return fastest<Boundary::walls>();
    case Boundary::periodic:
      return fastest<Boundary::periodic>();
    default:
      return fastest<Boundary::open>();
  }
}

}  // namespace pf
