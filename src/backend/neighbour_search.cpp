#include "backend/neighbour_search.hpp"

#include <algorithm>

#include "backend/near_filter.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

template <Boundary kBoundary>
void list_ranges(const SearchSpace& space, Vec2i here, CandidateRanges& ranges) {
  if (space.all_pairs) return ranges.list_all(space.num_parcels);
  ranges.list<kBoundary>(space.grid, space.cell_start, here, space.reach, space.num_parcels);
}

// Tests one parcel at a time.
template <Boundary kBoundary>
void search_plainly(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch) {
  const Vec2i here = space.position[i];
  list_ranges<kBoundary>(space, here, scratch.ranges);
  scratch.candidates.clear();
  for (int r = 0; r < scratch.ranges.num; ++r) {
    for (std::uint32_t j = scratch.ranges.at[r].first; j < scratch.ranges.at[r].last; ++j) {
      const Vec2i offset = separation<kBoundary>(space.world, here, space.position[j]);
      const float x = static_cast<float>(offset.x);
      const float y = static_cast<float>(offset.y);
      if (j != i && x * x + y * y < space.filter_distance2) scratch.candidates.push_back(j);
    }
  }
}

#if defined(__x86_64__)

void take(unsigned mask, std::uint32_t first, std::vector<std::uint32_t>& candidates) {
  for (; mask != 0; mask &= mask - 1) candidates.push_back(first + kOrder[__builtin_ctz(mask)]);
}

// Tests eight parcels at a time. A box of at most three rows, the usual case, takes no branch on the number
// of rows and parcels: these differ from parcel to parcel, so that branches would be mispredicted.
template <Boundary kBoundary>
__attribute__((PF_AVX2)) void search_avx2(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch) {
  const Vec2i here = space.position[i];
  if constexpr (kBoundary == Boundary::periodic) {
    if (!space.all_pairs && is_far_from_edge(space.world, here, space.reach))
      return search_avx2<Boundary::open>(space, i, scratch);
  }
  const Filter<kBoundary> filter(space, i);
  scratch.candidates.clear();

  const GridShape& grid = space.grid;
  const CellSpan sx = cell_span<kBoundary>(here.x, space.reach, grid.x);
  const CellSpan sy = cell_span<kBoundary>(here.y, space.reach, grid.y);
  const bool whole = sx.second_first > sx.second_last && sy.second_first > sy.second_last;
  if (!space.all_pairs && whole && sy.last - sy.first <= 2) {
    std::uint32_t first[3], last[3];
    unsigned mask[3];
    for (int k = 0; k < 3; ++k) {
      const std::int32_t row = std::min(sy.first + k, sy.last);
      const std::uint32_t* starts = space.cell_start + static_cast<std::uint32_t>(row) * grid.x.num;
      first[k] = starts[sx.first];
      last[k] = sy.first + k <= sy.last ? starts[sx.last + 1] : first[k];
      mask[k] = filter.wanted(first[k], last[k]);
    }
    const bool more = last[0] - first[0] > 8 || last[1] - first[1] > 8 || last[2] - first[2] > 8;
    if (!more && (mask[0] | mask[1] | mask[2]) == 0) return;
    for (int k = 0; k < 3; ++k) {
      take(mask[k], first[k], scratch.candidates);
      for (std::uint32_t j = first[k] + 8; j < last[k]; j += 8)
        take(filter.wanted(j, last[k]), j, scratch.candidates);
    }
    return;
  }
  list_ranges<kBoundary>(space, here, scratch.ranges);
  for (int r = 0; r < scratch.ranges.num; ++r) {
    const auto [first, last] = scratch.ranges.at[r];
    for (std::uint32_t j = first; j < last; j += 8) take(filter.wanted(j, last), j, scratch.candidates);
  }
}

#endif

template <Boundary kBoundary>
Search fastest() {
#if defined(__x86_64__)
  if (has_avx2()) return search_avx2<kBoundary>;
#endif
  return search_plainly<kBoundary>;
}

}  // namespace

Search plain_search(Boundary boundary) {
  return for_boundary(boundary, []<Boundary kBoundary>() -> Search { return search_plainly<kBoundary>; });
}

Search choose_search(Boundary boundary) {
  return for_boundary(boundary, []<Boundary kBoundary>() { return fastest<kBoundary>(); });
}

}  // namespace pf
