#include "backend/candidate_search.hpp"

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
                                        if (num < SearchScratch::kMostRanges) scratch.ranges[num] = {first, last};
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
__attribute__((target("avx2"), always_inline)) inline __m256i nearest_image(__m256i d, __m256i half, __m256i period) {
  if constexpr (kBoundary == Boundary::periodic) {
    const __m256i too_high = _mm256_cmpgt_epi32(d, _mm256_sub_epi32(half, _mm256_set1_epi32(1)));
    const __m256i too_low = _mm256_cmpgt_epi32(_mm256_sub_epi32(_mm256_setzero_si256(), half), d);
    d = _mm256_sub_epi32(d, _mm256_and_si256(too_high, period));
    d = _mm256_add_epi32(d, _mm256_and_si256(too_low, period));
  }
  return d;
}

// Eight candidates at a time.
template <Boundary kBoundary>
__attribute__((target("avx2"))) void search_avx2(const SearchSpace& space, std::uint32_t i,
                                                 SearchScratch& scratch) {
  const Vec2i here = space.position[i];
  list_ranges<kBoundary>(space, here, scratch);
  const __m256i centre = _mm256_set_epi32(here.y, here.x, here.y, here.x, here.y, here.x, here.y, here.x);
  const int hx = space.world.half.x, hy = space.world.half.y;
  const __m256i half = _mm256_set_epi32(hy, hx, hy, hx, hy, hx, hy, hx);
  const __m256i period = _mm256_slli_epi32(half, 1);
  const __m256 filter = _mm256_set1_ps(space.filter_distance2);
  const __m256i self = _mm256_set1_epi32(static_cast<int>(i));
  // The horizontal add leaves the candidates in this order.
  const __m256i order = _mm256_set_epi32(7, 6, 3, 2, 5, 4, 1, 0);
  constexpr std::uint32_t kOrder[8] = {0, 1, 4, 5, 2, 3, 6, 7};
  scratch.finds.clear();
  for (int r = 0; r < scratch.num_ranges; ++r) {
    const __m256i last = _mm256_set1_epi32(static_cast<int>(scratch.ranges[r].last));
    for (std::uint32_t j = scratch.ranges[r].first; j < scratch.ranges[r].last; j += 8) {
      const auto* from = reinterpret_cast<const __m256i*>(space.position + j);
      const __m256i a =
          nearest_image<kBoundary>(_mm256_sub_epi32(_mm256_loadu_si256(from), centre), half, period);
      const __m256i b =
          nearest_image<kBoundary>(_mm256_sub_epi32(_mm256_loadu_si256(from + 1), centre), half, period);
      const __m256 fa = _mm256_cvtepi32_ps(a);
      const __m256 fb = _mm256_cvtepi32_ps(b);
      const __m256 distance2 = _mm256_hadd_ps(_mm256_mul_ps(fa, fa), _mm256_mul_ps(fb, fb));
      const __m256i index = _mm256_add_epi32(order, _mm256_set1_epi32(static_cast<int>(j)));
      const __m256i wanted =
          _mm256_andnot_si256(_mm256_cmpeq_epi32(index, self), _mm256_cmpgt_epi32(last, index));
      const __m256 near = _mm256_and_ps(_mm256_cmp_ps(distance2, filter, _CMP_LT_OQ), _mm256_castsi256_ps(wanted));
      for (auto mask = static_cast<unsigned>(_mm256_movemask_ps(near)); mask != 0; mask &= mask - 1) {
        scratch.finds.push_back(j + kOrder[__builtin_ctz(mask)]);
      }
    }
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
    case Boundary::walls: return search_plainly<Boundary::walls>;
    case Boundary::periodic: return search_plainly<Boundary::periodic>;
    default: return search_plainly<Boundary::open>;
  }
}

Search choose_search(Boundary boundary) {
  switch (boundary) {
    case Boundary::walls: return fastest<Boundary::walls>();
    case Boundary::periodic: return fastest<Boundary::periodic>();
    default: return fastest<Boundary::open>();
  }
}

}  // namespace pf
