#include "backend/time_step/pair_search.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <limits>

#include "backend/avx2.hpp"
#include "core/resize.hpp"

namespace pf {
namespace {

// Counts of 0 .. ParcelCount::kMax parcels.
constexpr auto kCounts = [] {
  std::array<ParcelCount, ParcelCount::kMax + 1> counts{};
  for (unsigned num = 0; num <= ParcelCount::kMax; ++num) {
    const unsigned first = std::min(num, 8U);
    counts[num] = {static_cast<std::uint8_t>((1U << first) - 1), static_cast<std::uint8_t>(num - first)};
  }
  return counts;
}();

constexpr ParcelCount count_of(std::uint32_t num) { return kCounts[num]; }

std::size_t num_of(ParcelCount count) {
  return static_cast<std::size_t>(std::popcount(count.bits)) + count.more;
}

// Only parcels of the first and the last two cells (the last one may be narrower than others) cross a
// periodic edge or touch others across it: parcels in the next cells are more than the contact distance from
// any parcel that has crossed, as long as the grid covers the search.
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
  num_in_cells_ = cell_start[grid.num_cells()];
  std::atomic<bool> has_boxes = false;
  constexpr std::size_t kMinRows = 4;
  const auto num_rows = static_cast<std::size_t>(grid.y.num);
  const std::size_t num_parts = team.num_parts(num_rows, kMinRows);
  team.run_parts(num_parts, [&](unsigned, std::size_t part) {
    const auto [begin, end] = ThreadTeam::share(part, num_parts, num_rows);
    for (std::size_t row = begin; row < end; ++row) {
      if (prepare_row(grid, boundary, cell_start, row)) has_boxes = true;
    }
  });
  has_boxes_ = has_boxes;
}

std::size_t PairSearch::reach(std::size_t end) const {
  const std::size_t last = std::min(end, num_in_cells_);
  if (last == 0) return 0;
  const Ranges& r = ranges_[last - 1];  // No parcel before it reaches farther.
  return std::max(last + num_of(r.own), r.next_first + num_of(r.next));
}

// Ranges of four parcels are written at once, also where a cell has fewer: the next cell's overwrite them.
bool PairSearch::prepare_row(const GridShape& grid, Boundary boundary,
                             const std::vector<std::uint32_t>& cell_start, std::size_t row) {
  const auto width = static_cast<std::size_t>(grid.x.num);
  const std::uint32_t* own = cell_start.data() + row * width;
  const bool has_next = row + 1 < static_cast<std::size_t>(grid.y.num);
  const bool edge_row =
      boundary == Boundary::periodic && is_at_edge(static_cast<std::int32_t>(row), grid.y.num);
  // A range as one word, since the processor waits where bytes are written and then read together.
  constexpr auto word = [](const Ranges& ranges) { return std::bit_cast<std::uint64_t>(ranges); };
  constexpr std::uint64_t kFirst = word({1, {}, {}}), kOwnBits = word({0, {1, 0}, {}}),
                          kNextBits = word({0, {}, {1, 0}}), kNextMore = word({0, {}, {0, 1}});
  bool has_boxes = false;
  for (std::int32_t x = 0; x < grid.x.num; ++x) {
    const std::uint32_t begin = own[x], end = own[x + 1];
    const std::int32_t last = std::min(x + 1, grid.x.num - 1) + 1;
    std::uint32_t next_first = own[width], num_next = 0;
    if (has_next) {
      next_first = own[width + static_cast<std::size_t>(std::max(x - 1, 0))];
      num_next = own[width + static_cast<std::size_t>(last)] - next_first;
    }
    const std::uint32_t own_last = own[last];
    const bool by_box = edge_row || (boundary == Boundary::periodic && is_at_edge(x, grid.x.num)) ||
                        std::max(own_last - begin, num_next) > ParcelCount::kMax;
    const auto ranges_of = [&](std::uint32_t i) -> Ranges {
      return {next_first, count_of(own_last - i - 1), count_of(num_next)};
    };
    has_boxes = has_boxes || by_box;
    if (by_box) {
      std::fill(ranges_.begin() + begin, ranges_.begin() + end, Ranges{0, {0, kByBox}, {}});
    } else if (own_last <= begin + 8 && begin + 4 <= own[width]) {
      const ParcelCount next = count_of(num_next);
      const std::uint64_t rest = next_first * kFirst + next.bits * kNextBits + next.more * kNextMore;
      const std::uint64_t bits = (1U << (own_last - begin)) - 1;
      for (std::uint32_t k = 0; k < 4; ++k)
        ranges_[begin + k] = std::bit_cast<Ranges>(rest + (bits >> (k + 1)) * kOwnBits);
      for (std::uint32_t i = begin + 4; i < end; ++i) ranges_[i] = ranges_of(i);
    } else {
      for (std::uint32_t i = begin; i < end; ++i) ranges_[i] = ranges_of(i);
    }
  }
  return has_boxes;
}

#if defined(__x86_64__)

namespace {

// Bits of eight parcels that are near.
struct RoughFilter {
  const std::uint32_t* rough;
  __m256i limit;

  __attribute__((PF_AVX2, always_inline)) RoughFilter(const RoughPositions& in)
      : rough(in.data()), limit(_mm256_set1_epi32(in.scale().limit())) {}

  __attribute__((PF_AVX2, always_inline)) unsigned near_bits(__m256i centre, std::uint32_t first) const {
    const auto* at = reinterpret_cast<const __m256i*>(rough + first);
    const __m256i offset = _mm256_sub_epi16(_mm256_loadu_si256(at), centre);
    const __m256i is_near = _mm256_cmpgt_epi32(limit, _mm256_madd_epi16(offset, offset));
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(is_near)));
  }
};

// A parcel with a partner, or with more candidates than were tested.
struct Hit {
  std::uint32_t parcel;
  std::uint32_t bits;  // of the partners: eight that follow, eight of the row above
};

void take_pairs(unsigned mask, std::uint32_t i, std::uint32_t first, std::vector<TouchingPair>& pairs) {
  for (; mask != 0; mask &= mask - 1)
    pairs.push_back({i, first + static_cast<std::uint32_t>(__builtin_ctz(mask))});
}

}  // namespace

// Sixteen candidates of each parcel are tested, and no branch depends on how many there are: it would be
// mispredicted. The few parcels that need more are listed.
__attribute__((PF_AVX2)) void PairSearch::find(const SearchSpace& space, Search search,
                                               const RoughPositions& rough, std::size_t begin,
                                               std::size_t end, std::vector<TouchingPair>& pairs) const {
  constexpr std::size_t kAhead = 256;  // parcels; the processor by itself starts anew at every page of memory
  constexpr std::size_t kBlock = 512;
  Hit hits[kBlock];
  SearchScratch scratch;
  const RoughFilter filter(rough);
  end = std::min(end, num_in_cells_);
  for (std::size_t block = begin; block < end; block += kBlock) {
    std::size_t num_hits = 0;
    for (std::size_t k = block; k < std::min(end, block + kBlock); ++k) {
      const auto i = static_cast<std::uint32_t>(k);
      const Ranges r = ranges_[k];
      const __m256i centre = _mm256_set1_epi32(static_cast<int>(filter.rough[k]));
      __builtin_prefetch(ranges_.data() + k + kAhead);
      __builtin_prefetch(filter.rough + r.next_first + kAhead);
      const unsigned own = filter.near_bits(centre, i + 1) & r.own.bits,
                     next = filter.near_bits(centre, r.next_first) & r.next.bits;
      hits[num_hits] = {i, own | next << 8};
      num_hits += (own | next | r.own.more | r.next.more) != 0 ? 1 : 0;
    }
    for (std::size_t h = 0; h < num_hits; ++h) {
      const auto [i, bits] = hits[h];
      const Ranges r = ranges_[i];
      if (r.own.more == kByBox) {
        search(space, i, scratch);
        for (const std::uint32_t j : scratch.candidates)
          if (j > i) pairs.push_back({i, j});  // The others find i.
        continue;
      }
      take_pairs(bits & 0xFFU, i, i + 1, pairs);
      take_pairs(bits >> 8, i, r.next_first, pairs);
      if ((r.own.more | r.next.more) == 0) continue;
      const __m256i centre = _mm256_set1_epi32(static_cast<int>(filter.rough[i]));
      for (std::uint32_t n = 0; n < r.own.more; n += 8) {
        const unsigned near = filter.near_bits(centre, i + 9 + n);
        take_pairs(near & count_of(r.own.more - n).bits, i, i + 9 + n, pairs);
      }
      for (std::uint32_t n = 0; n < r.next.more; n += 8) {
        const unsigned near = filter.near_bits(centre, r.next_first + 8 + n);
        take_pairs(near & count_of(r.next.more - n).bits, i, r.next_first + 8 + n, pairs);
      }
    }
  }
}

#else

void PairSearch::find(const SearchSpace&, Search, const RoughPositions&, std::size_t, std::size_t,
                      std::vector<TouchingPair>&) const {}

#endif

}  // namespace pf
