#include "backend/time_step/pair_search.hpp"

#include <algorithm>
#include <limits>

#include "backend/near_filter.hpp"
#include "core/resize.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

// Of ranges that cannot be tabulated, because the pair may touch across a periodic edge.
constexpr std::uint32_t kAtEdge = UINT32_MAX;

// Only parcels of the first and the last two cells (the last one may be narrower than others) cross a
// periodic edge or touch others across it: those of the next cells are farther than the contact distance from
// whatever has crossed, as long as the grid covers the search.
bool is_at_edge(std::int32_t cell, std::int32_t num) { return cell == 0 || cell >= num - 2; }

}  // namespace

std::int64_t PairSearch::max_reach(const GridShape& grid) {
  const auto of = [](const GridAxis& axis) {
    return axis.num <= 2 ? std::numeric_limits<std::int64_t>::max() : (std::int64_t{1} << 32) / axis.factor;
  };
  return std::min(of(grid.x), of(grid.y));
}

void PairSearch::prepare(ThreadTeam& team, const GridShape& grid, Boundary boundary, std::size_t num_parcels,
                         const std::vector<std::uint32_t>& cell_start) {
  resize_tightly(ranges_, num_parcels);
  team.run([&](unsigned thread) {
    const auto [begin, end] = team.share(thread, static_cast<std::size_t>(grid.y.num));
    for (std::size_t row = begin; row < end; ++row) prepare_row(grid, boundary, cell_start, row);
  });
  std::fill(ranges_.begin() + cell_start[grid.num_cells()], ranges_.end(), Ranges{});  // retired
}

void PairSearch::prepare_row(const GridShape& grid, Boundary boundary,
                             const std::vector<std::uint32_t>& cell_start, std::size_t row) {
  const auto width = static_cast<std::size_t>(grid.x.num);
  const std::uint32_t* own = cell_start.data() + row * width;
  const bool has_next = row + 1 < static_cast<std::size_t>(grid.y.num);
  const bool edge_row =
      boundary == Boundary::periodic && is_at_edge(static_cast<std::int32_t>(row), grid.y.num);
  for (std::int32_t x = 0; x < grid.x.num; ++x) {
    const std::int32_t last = std::min(x + 1, grid.x.num - 1) + 1;
    Ranges ranges{own[last], 0, 0};
    if (has_next) {
      ranges.next_first = own[width + static_cast<std::size_t>(std::max(x - 1, 0))];
      ranges.next_last = own[width + static_cast<std::size_t>(last)];
    }
    if (edge_row || (boundary == Boundary::periodic && is_at_edge(x, grid.x.num))) ranges.own_last = kAtEdge;
    std::fill(ranges_.begin() + own[x], ranges_.begin() + own[x + 1], ranges);
  }
}

bool PairSearch::looks_at(std::uint32_t i, std::uint32_t j) const {
  const Ranges& r = ranges_[i];
  if (r.own_last == kAtEdge) return i < j;
  return (j > i && j < r.own_last) || (j >= r.next_first && j < r.next_last);
}

#if defined(__x86_64__)

namespace {

void take_pairs(unsigned mask, std::uint32_t i, std::uint32_t first, std::vector<TouchingPair>& pairs) {
  for (; mask != 0; mask &= mask - 1) pairs.push_back({i, first + kOrder[__builtin_ctz(mask)]});
}

}  // namespace

// Of ranges of up to eight parcels, the usual case, no branch depends on how many there are.
__attribute__((PF_AVX2)) void PairSearch::find(const SearchSpace& space, Search search, std::size_t begin,
                                               std::size_t end, std::vector<TouchingPair>& pairs) const {
  SearchScratch scratch;
  for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) {
    const Ranges r = ranges_[i];
    if (r.own_last == kAtEdge) {
      search(space, i, scratch);
      for (const std::uint32_t j : scratch.candidates)
        if (!looks_at(j, i)) pairs.push_back({i, j});
      continue;
    }
    const Filter<Boundary::open> filter(space, i);
    const std::uint32_t num_own = std::max(r.own_last, i + 1) - (i + 1),
                        num_next = r.next_last - r.next_first;
    const unsigned own = filter.near_bits(i + 1) & kFirstBits[std::min(num_own, 8U)];
    const unsigned next = filter.near_bits(r.next_first) & kFirstBits[std::min(num_next, 8U)];
    if ((own | next) == 0 && num_own <= 8 && num_next <= 8) continue;
    take_pairs(own, i, i + 1, pairs);
    for (std::uint32_t j = i + 9; j < r.own_last; j += 8)
      take_pairs(filter.wanted(j, r.own_last), i, j, pairs);
    take_pairs(next, i, r.next_first, pairs);
    for (std::uint32_t j = r.next_first + 8; j < r.next_last; j += 8)
      take_pairs(filter.wanted(j, r.next_last), i, j, pairs);
  }
}

#else

void PairSearch::find(const SearchSpace&, Search, std::size_t, std::size_t,
                      std::vector<TouchingPair>&) const {}

#endif

}  // namespace pf
