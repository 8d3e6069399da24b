#include "backend/candidate_search.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>

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

// The test of one parcel against the others, one at a time.
template <Boundary kBoundary, Wanted kWanted>
struct PlainFilter {
  const SearchSpace& space;
  std::uint32_t self;
  Vec2i here = space.position[self];
  bool on_own_line = kWanted == Wanted::reachable;
  Vec2i line_begin = on_own_line ? space.line_begin : here;
  Vec2f line_velocity = on_own_line ? space.line_velocity : (space.velocity ? space.velocity[self] : Vec2f{});

  bool is_near(std::uint32_t j) const {
    const Vec2i offset = separation<kBoundary>(space.world, here, space.position[j]);
    const float x = static_cast<float>(offset.x);
    const float y = static_cast<float>(offset.y);
    return x * x + y * y < space.filter_distance2;
  }
  bool is_meeting(std::uint32_t j) const {
    const Vec2i offset = separation<kBoundary>(space.world, line_begin, space.position[j]);
    return may_meet(offset, space.velocity[j] - line_velocity, space.contact, space.units_in_step_per_mps);
  }
  // Others may take parcels at the same time.
  bool is_owned(std::uint32_t j) const {
    return std::atomic_ref<std::uint32_t>(const_cast<std::uint32_t&>(space.owner[j])).load() != kNone;
  }
  bool wants(std::uint32_t j) const {
    if constexpr (kWanted == Wanted::near) return j != self && is_near(j);
    if constexpr (kWanted == Wanted::meeting_later) return j > self && is_meeting(j);
    return j != self && is_near(j) && (is_owned(j) || is_meeting(j));
  }
};

template <Boundary kBoundary, Wanted kWanted>
void search_plainly(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch) {
  const PlainFilter<kBoundary, kWanted> filter{space, i};
  list_ranges<kBoundary>(space, filter.here, scratch);
  scratch.finds.clear();
  for (int r = 0; r < scratch.num_ranges; ++r) {
    for (std::uint32_t j = scratch.ranges[r].first; j < scratch.ranges[r].last; ++j) {
      if (filter.wants(j)) scratch.finds.push_back(j);
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

// Eight pairs x, y as all x and all y, in the order of kOrder.
struct Eight {
  __m256 x, y;
  __attribute__((target("avx2"), always_inline)) Eight(__m256 a, __m256 b)
      : x(_mm256_shuffle_ps(a, b, 0x88)), y(_mm256_shuffle_ps(a, b, 0xDD)) {}
};

// Other threads may take parcels while a search reads who owns them: aligned words, which x86 reads whole.
// What matters is that a search after a thread's own taking sees all that were taken before, and after a
// locked instruction it does. Vector loads cannot be atomic in C++ and the thread sanitizer knows none of
// this, so it does not look at these searches; the plain one reads owners atomically.
#define PF_AVX2 target("avx2"), no_sanitize_thread

// The same, eight parcels first .. first + 7 at a time: a bit each of those below last, wanted, and not self.
template <Boundary kBoundary, Wanted kWanted>
struct Filter {
  static constexpr bool kTellsMeeting = kWanted != Wanted::near;
  static constexpr bool kTellsNear = kWanted != Wanted::meeting_later;

  const SearchSpace& space;
  __m256i centre, line_begin, half, period, self;
  __m256 speed_x, speed_y;

  __attribute__((PF_AVX2, always_inline)) Filter(const SearchSpace& in, std::uint32_t i) : space(in) {
    const int hx = in.world.half.x, hy = in.world.half.y;
    centre = line_begin = _mm256_set1_epi64x(bit_copy<long long>(in.position[i]));
    half = _mm256_set_epi32(hy, hx, hy, hx, hy, hx, hy, hx);
    period = _mm256_slli_epi32(half, 1);
    self = _mm256_set1_epi32(static_cast<int>(i));
    if constexpr (kTellsMeeting) {
      constexpr bool kOwnLine = kWanted == Wanted::reachable;
      const Vec2f velocity = kOwnLine ? in.line_velocity : in.velocity[i];
      speed_x = _mm256_set1_ps(velocity.x);
      speed_y = _mm256_set1_ps(velocity.y);
      if constexpr (kOwnLine) line_begin = _mm256_set1_epi64x(bit_copy<long long>(in.line_begin));
    }
  }

  __attribute__((PF_AVX2, always_inline)) Eight offsets(std::uint32_t first, __m256i from) const {
    const auto* at = reinterpret_cast<const __m256i*>(space.position + first);
    const __m256i a = _mm256_sub_epi32(_mm256_loadu_si256(at), from);
    const __m256i b = _mm256_sub_epi32(_mm256_loadu_si256(at + 1), from);
    return Eight(_mm256_cvtepi32_ps(nearest_image<kBoundary>(a, half, period)),
                 _mm256_cvtepi32_ps(nearest_image<kBoundary>(b, half, period)));
  }

  __attribute__((PF_AVX2, always_inline)) __m256 is_near(std::uint32_t first) const {
    const Eight e = offsets(first, centre);
    const __m256 squared = _mm256_add_ps(_mm256_mul_ps(e.x, e.x), _mm256_mul_ps(e.y, e.y));
    return _mm256_cmp_ps(squared, _mm256_set1_ps(space.filter_distance2), _CMP_LT_OQ);
  }

  // may_meet of model/exact.hpp, operation by operation.
  __attribute__((PF_AVX2, always_inline)) __m256 is_meeting(std::uint32_t first) const {
    const Eight e = offsets(first, line_begin);
    const float* velocity = &space.velocity[first].x;
    const Eight v(_mm256_loadu_ps(velocity), _mm256_loadu_ps(velocity + 8));
    const __m256 units = _mm256_set1_ps(space.units_in_step_per_mps);
    const __m256 wx = _mm256_mul_ps(_mm256_sub_ps(v.x, speed_x), units);
    const __m256 wy = _mm256_mul_ps(_mm256_sub_ps(v.y, speed_y), units);
    const __m256 e2 = _mm256_add_ps(_mm256_mul_ps(e.x, e.x), _mm256_mul_ps(e.y, e.y));
    const __m256 w2 = _mm256_add_ps(_mm256_mul_ps(wx, wx), _mm256_mul_ps(wy, wy));
    const __m256 b = _mm256_add_ps(_mm256_mul_ps(e.x, wx), _mm256_mul_ps(e.y, wy));
    const __m256 m = _mm256_sub_ps(_mm256_mul_ps(e.x, wy), _mm256_mul_ps(e.y, wx));
    const __m256 margin = _mm256_set1_ps(kMeetingMargin);
    const __m256 slack = _mm256_mul_ps(margin, _mm256_add_ps(e2, w2));
    const __m256 contact2 = _mm256_set1_ps(space.contact * space.contact);
    const __m256 not_parting = _mm256_cmp_ps(b, slack, _CMP_NGT_UQ);
    const __m256 touching = _mm256_cmp_ps(_mm256_sub_ps(e2, contact2), slack, _CMP_LE_OQ);
    const __m256 widest =
        _mm256_add_ps(_mm256_mul_ps(_mm256_mul_ps(contact2, w2), _mm256_set1_ps(1.0F + kMeetingMargin)),
                      _mm256_mul_ps(_mm256_mul_ps(margin, e2), w2));
    const __m256 not_passing = _mm256_cmp_ps(_mm256_mul_ps(m, m), widest, _CMP_NGT_UQ);
    const __m256 at_end = _mm256_add_ps(_mm256_add_ps(e2, _mm256_mul_ps(_mm256_set1_ps(2.0F), b)), w2);
    const __m256 there = _mm256_or_ps(
        _mm256_cmp_ps(at_end, _mm256_add_ps(contact2, slack), _CMP_LE_OQ),
        _mm256_cmp_ps(_mm256_sub_ps(_mm256_setzero_ps(), b), _mm256_add_ps(w2, slack), _CMP_LE_OQ));
    return _mm256_and_ps(not_parting, _mm256_or_ps(touching, _mm256_and_ps(not_passing, there)));
  }

  __attribute__((PF_AVX2, always_inline)) __m256i is_owned(std::uint32_t first) const {
    const __m256i owner = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(space.owner + first));
    const __m256i none = _mm256_cmpeq_epi32(owner, _mm256_set1_epi32(-1));
    const __m256i in_order = _mm256_permutevar8x32_epi32(none, _mm256_set_epi32(7, 6, 3, 2, 5, 4, 1, 0));
    return _mm256_andnot_si256(in_order, _mm256_set1_epi32(-1));
  }

  __attribute__((PF_AVX2, always_inline)) unsigned wanted(std::uint32_t first, std::uint32_t last) const {
    const __m256i order = _mm256_set_epi32(7, 6, 3, 2, 5, 4, 1, 0);
    const __m256i index = _mm256_add_epi32(order, _mm256_set1_epi32(static_cast<int>(first)));
    const __m256i inside = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(last)), index);
    const __m256i others = _mm256_andnot_si256(_mm256_cmpeq_epi32(index, self), inside);
    __m256 found = _mm256_castsi256_ps(others);
    if constexpr (kTellsNear) found = _mm256_and_ps(found, is_near(first));
    if constexpr (kWanted == Wanted::meeting_later) found = _mm256_and_ps(found, is_meeting(first));
    if constexpr (kWanted == Wanted::reachable)
      found = _mm256_and_ps(found, _mm256_or_ps(_mm256_castsi256_ps(is_owned(first)), is_meeting(first)));
    return static_cast<unsigned>(_mm256_movemask_ps(found));
  }
};

// The shuffles leave the eight candidates in this order.
constexpr std::uint32_t kOrder[8] = {0, 1, 4, 5, 2, 3, 6, 7};

inline void take(unsigned mask, std::uint32_t first, std::vector<std::uint32_t>& finds) {
  for (; mask != 0; mask &= mask - 1) finds.push_back(first + kOrder[__builtin_ctz(mask)]);
}

// Whether no search box around it crosses the edge of a periodic world: then whoever is within reach is so by
// the stored positions, and whoever else is more than half a world away by them is out of reach.
inline bool is_far_from_edge(const SearchSpace& space, Vec2i here) {
  const auto room = [&](std::int32_t position, std::int32_t half) {
    return static_cast<std::int64_t>(half) - std::abs(static_cast<std::int64_t>(position));
  };
  return room(here.x, space.world.half.x) > space.reach && room(here.y, space.world.half.y) > space.reach;
}

// Eight candidates at a time. A box of at most three rows, as nearly all are, goes without a branch on how
// many rows and parcels there are: these differ from parcel to parcel and would be mispredicted.
template <Boundary kBoundary, Wanted kWanted>
__attribute__((PF_AVX2)) void search_avx2(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch) {
  const Vec2i here = space.position[i];
  if constexpr (kBoundary == Boundary::periodic) {
    if (!space.all_pairs && is_far_from_edge(space, here))
      return search_avx2<Boundary::open, kWanted>(space, i, scratch);
  }
  const Filter<kBoundary, kWanted> filter(space, i);
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
      if constexpr (kWanted == Wanted::meeting_later) {  // the lowest row mostly goes, the others mostly stay
        first[k] = std::max(first[k], i + 1);
        mask[k] = 0;
        if (last[k] <= first[k]) {
          last[k] = first[k];
          continue;
        }
      }
      mask[k] = filter.wanted(first[k], last[k]);
    }
    const bool more = last[0] - first[0] > 8 || last[1] - first[1] > 8 || last[2] - first[2] > 8;
    if (!more && (mask[0] | mask[1] | mask[2]) == 0) return;
    for (int k = 0; k < 3; ++k) {
      take(mask[k], first[k], scratch.finds);
      for (std::uint32_t j = first[k] + 8; j < last[k]; j += 8)
        take(filter.wanted(j, last[k]), j, scratch.finds);
    }
    return;
  }
  list_ranges<kBoundary>(space, here, scratch);
  for (int r = 0; r < scratch.num_ranges; ++r) {
    const auto [begin, last] = scratch.ranges[r];
    const std::uint32_t first = kWanted == Wanted::meeting_later ? std::max(begin, i + 1) : begin;
    for (std::uint32_t j = first; j < last; j += 8) take(filter.wanted(j, last), j, scratch.finds);
  }
}

#endif

template <Boundary kBoundary, Wanted kWanted>
Search fastest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return search_avx2<kBoundary, kWanted>;
#endif
  return search_plainly<kBoundary, kWanted>;
}

template <Boundary kBoundary>
Search plain(Wanted wanted) {
  switch (wanted) {
    case Wanted::meeting_later:
      return search_plainly<kBoundary, Wanted::meeting_later>;
    case Wanted::reachable:
      return search_plainly<kBoundary, Wanted::reachable>;
    default:
      return search_plainly<kBoundary, Wanted::near>;
  }
}

template <Boundary kBoundary>
Search fastest(Wanted wanted) {
  switch (wanted) {
    case Wanted::meeting_later:
      return fastest<kBoundary, Wanted::meeting_later>();
    case Wanted::reachable:
      return fastest<kBoundary, Wanted::reachable>();
    default:
      return fastest<kBoundary, Wanted::near>();
  }
}

}  // namespace

Search plain_search(Boundary boundary, Wanted wanted) {
  switch (boundary) {
    case Boundary::walls:
      return plain<Boundary::walls>(wanted);
    case Boundary::periodic:
      return plain<Boundary::periodic>(wanted);
    default:
      return plain<Boundary::open>(wanted);
  }
}

Search choose_search(Boundary boundary, Wanted wanted) {
  switch (boundary) {
    case Boundary::walls:
      return fastest<Boundary::walls>(wanted);
    case Boundary::periodic:
      return fastest<Boundary::periodic>(wanted);
    default:
      return fastest<Boundary::open>(wanted);
  }
}

}  // namespace pf
