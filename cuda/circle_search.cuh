// Search for the parcels within a circle: a thread loops over the cells that a box around it covers.
#pragma once

#if defined(__CUDACC__)
#include "cuda/architecture.cuh"
#endif
#include "core/index.hpp"
#include "model/grid.hpp"

namespace pf {

// By value to kernels.
struct DeviceSearch {
  World world;
  GridShape grid;
  const std::uint32_t* cell_start = nullptr;  // grid.num_cells() + 2 entries
  std::uint32_t num_parcels = 0;
  bool all_pairs = false;
};

#if defined(__CUDACC__)

struct SearchCircle {
  Vec2i centre;
  std::uint32_t self;  // parcel that is left out, or kInvalidIndex
  std::int32_t reach;  // half side of the search box; from kHalfSide on the box is the whole world
  float radius2;       // square of the circle's radius, position units
};

// Less than zero for an offset from the centre that is within a circle.
__device__ __forceinline__ float past_radius(float x, float y, float radius2) {
  return __fmaf_rn(x, x, __fmaf_rn(y, y, -radius2));
}

// The same for a position.
template <Boundary kBoundary>
__device__ __forceinline__ float past_circle(const DeviceSearch& space, const SearchCircle& circle,
                                             int2 there) {
  const Vec2i offset = separation<kBoundary>(space.world, circle.centre, {there.x, there.y});
  return past_radius(static_cast<float>(offset.x), static_cast<float>(offset.y), circle.radius2);
}

// A circle that search_box() searches, for parcels with an index of `from` or more. Other types, which search
// two at once (TwoCircles) or with whole warps, have the same members. kRowsOfLoop: of cells that are one
// loop; with two, begin() is the first index. kIsReadOnly: nothing writes positions while the kernel runs.
template <Boundary kBoundary, int kRowsOfLoop, bool kIsReadOnly>
struct OneCircle {
  static constexpr unsigned kNum = 1;  // circles
  // Of the circles from this one on, the parcels that they are around, own(n), are left out.
  static constexpr unsigned kFirstLeftOut = 1;
  static constexpr int kRows = kRowsOfLoop;
  static constexpr bool kReadOnly = kIsReadOnly;
  // Whether whole warps search, so that the threads of a warp wait for each other now and then. Otherwise
  // those that have found many may be left to work one after the other.
  static constexpr bool kWholeWarps = false;

  const SearchCircle& circle;
  std::uint32_t from = 0;

  __device__ __forceinline__ std::uint32_t own(unsigned) const { return circle.self; }
  __device__ __forceinline__ std::uint32_t begin() const { return from; }
  // The first parcel that is looked at, of a range from `first` on.
  __device__ __forceinline__ std::uint32_t skip(std::uint32_t first) const { return max(first, from); }

  // Shifts a bit for a position into the word of each circle: the sign of past_circle(), since a comparison
  // would take three instructions.
  __device__ __forceinline__ void shift_in(const DeviceSearch& space, int2 there,
                                           std::uint32_t (&near)[kNum]) const {
    near[0] = __funnelshift_l(__float_as_uint(past_circle<kBoundary>(space, circle, there)), near[0], 1);
  }
};

// Returns whether a loop goes on: for a thread, or for one of its warp if whole warps search.
template <class Circles>
__device__ __forceinline__ bool goes_on(bool for_thread) {
  if constexpr (Circles::kWholeWarps)
    return __any_sync(0xFFFFFFFFU, for_thread) != 0;
  else
    return for_thread;
}

// Indices [first, first + count) of sorted parcels.
struct ParcelRange {
  std::uint32_t first, count;
};

// Positions that search_ranges() reads at a time, the last ones up to three beyond the end of a range.
constexpr unsigned kReadTogether = 4;

// Ranges as one loop, whose index k counts through them, all but the last filled up to whole turns.
template <unsigned kNumRanges>
struct RangeLoop {
  std::uint32_t begin[kNumRanges], end[kNumRanges], to_index[kNumRanges];

  __device__ __forceinline__ explicit RangeLoop(const ParcelRange (&ranges)[kNumRanges]) {
    std::uint32_t next = 0;
#pragma unroll
    for (unsigned r = 0; r < kNumRanges; ++r) {
      begin[r] = next;
      end[r] = next + ranges[r].count;
      to_index[r] = ranges[r].first - next;
      next += (ranges[r].count + kReadTogether - 1) / kReadTogether * kReadTogether;
    }
  }

  __device__ __forceinline__ std::uint32_t index_at(std::uint32_t k) const { return k + at(k, to_index); }
  __device__ __forceinline__ bool is_parcel(std::uint32_t k) const { return k < at(k, end); }
  // Of a parcel of the ranges; else it is nowhere.
  __device__ __forceinline__ std::uint32_t find(std::uint32_t index) const {
    std::uint32_t k = 1U << 31;
#pragma unroll
    for (unsigned r = 0; r < kNumRanges; ++r) {
      const std::uint32_t in_range = index - (begin[r] + to_index[r]);
      if (in_range < end[r] - begin[r]) k = begin[r] + in_range;
    }
    return k;
  }

 private:
  // The value of the range of k.
  __device__ __forceinline__ std::uint32_t at(std::uint32_t k,
                                              const std::uint32_t (&values)[kNumRanges]) const {
    std::uint32_t value = values[0];
#pragma unroll
    for (unsigned r = 1; r < kNumRanges; ++r) value = k < begin[r] ? value : values[r];
    return value;
  }
};

// Calls visit(n, j) for every parcel j of the ranges within the n-th circle. The ranges are one loop, so that
// a thread goes on with the next one while others of its warp still are in one before: with parcels read by
// twos the loop has 5.6 turns instead of 7.4 (two ranges, one circle; gas, area fraction 0.2), by fours 3.4.
template <class Circles, unsigned kNumRanges, class Visit>
__device__ __forceinline__ void search_ranges(const DeviceSearch& space, const Vec2i* position,
                                              const Circles& circles, const ParcelRange (&ranges)[kNumRanges],
                                              Visit visit) {
  constexpr unsigned kLast = Circles::kNum - 1;  // 0 or 1
  const RangeLoop<kNumRanges> loop(ranges);
  [[maybe_unused]] std::uint32_t left_out[Circles::kNum];
#pragma unroll
  for (unsigned n = Circles::kFirstLeftOut; n < Circles::kNum; ++n) left_out[n] = loop.find(circles.own(n));
  const std::uint32_t end = loop.end[kNumRanges - 1];
  for (std::uint32_t k = 0; goes_on<Circles>(k < end);) {
    const std::uint32_t next = min(end, k + 32);
    std::uint32_t near[kLast + 1] = {};  // a bit for each of the last 32, the lowest for k - 1
    if (!Circles::kWholeWarps || k < end)
#pragma unroll 1
      do {
        const int2* from = reinterpret_cast<const int2*>(position) + loop.index_at(k);
        int2 there[kReadTogether];
#pragma unroll
        for (unsigned u = 0; u < kReadTogether; ++u)
          there[u] = Circles::kReadOnly ? __ldg(from + u) : from[u];
#pragma unroll
        for (unsigned u = 0; u < kReadTogether; ++u) circles.shift_in(space, there[u], near);
        k += kReadTogether;
      } while (k < next);
    if constexpr (Circles::kWholeWarps) __syncwarp();
#pragma unroll
    for (unsigned n = Circles::kFirstLeftOut; n < Circles::kNum; ++n) {
      const std::uint32_t bit = k - 1 - left_out[n];
      if (bit < 32) near[n] &= ~(1U << bit);
    }
    while ((near[0] | near[kLast]) != 0) {
      const unsigned n = near[0] != 0 ? 0 : kLast;
      const std::uint32_t word = n == 0 ? near[0] : near[kLast];
      const auto bit = static_cast<std::uint32_t>(31 - __clz(static_cast<int>(word)));
      (n == 0 ? near[0] : near[kLast]) = word ^ (1U << bit);  // no reference: they are registers
      const std::uint32_t at = k - 1 - bit;
      if (loop.is_parcel(at)) visit(n, loop.index_at(at));
    }
    if constexpr (Circles::kWholeWarps) __syncwarp();
  }
}

// Positions from low to high along each axis.
struct SearchBounds {
  std::int32_t low_x, high_x, low_y, high_y;
};

// Calls search_ranges() for the parcels in the cells that the box covers, if this thread searches.
template <class Circles, class Visit>
__device__ __forceinline__ void search_box(const DeviceSearch& space, const Vec2i* position,
                                           const Circles& circles, const SearchBounds& box, bool searches,
                                           Visit visit) {
  const GridShape& grid = space.grid;
  const auto row_length = static_cast<std::uint32_t>(grid.x.num);
  const std::int32_t last_row = cell_coordinate(box.high_y, grid.y);
  std::int32_t row = cell_coordinate(box.low_y, grid.y);
  // Three rows would be two loops. Often the first one ends before begin().
  if constexpr (Circles::kRows == 2) {
    if (last_row - row > 1 &&
        space.cell_start[static_cast<std::uint32_t>(row + 1) * row_length] < circles.begin())
      ++row;
  }
  const std::int32_t column = cell_coordinate(box.low_x, grid.x);
  const auto num_columns = static_cast<std::uint32_t>(cell_coordinate(box.high_x, grid.x) - column + 1);
  std::uint32_t cell = static_cast<std::uint32_t>(row) * row_length + static_cast<std::uint32_t>(column);
  const auto range_in_row = [&](std::uint32_t first_cell) {
    const std::uint32_t first = circles.skip(space.cell_start[first_cell]);
    return ParcelRange{first, max(space.cell_start[first_cell + num_columns], first) - first};
  };
  constexpr int kRows = Circles::kRows;
  for (std::int32_t num_rows = searches ? last_row - row : -1; goes_on<Circles>(num_rows >= 0);
       num_rows -= kRows) {
    ParcelRange ranges[kRows];
#pragma unroll
    for (int r = 0; r < kRows; ++r) {
      ranges[r] = range_in_row(cell);
      if (num_rows < r) ranges[r].count = 0;
      if (num_rows > r) cell += row_length;  // else it stays in the box: other threads may go on
    }
    search_ranges(space, position, circles, ranges, visit);
  }
}

// Returns whether a box reaches across an edge of a periodic world.
template <Boundary kBoundary>
__device__ __forceinline__ bool crosses_edge(const World& world, const SearchBounds& box) {
  return kBoundary == Boundary::periodic && (box.low_x < -world.half.x || box.high_x >= world.half.x ||
                                             box.low_y < -world.half.y || box.high_y >= world.half.y);
}

// Calls visit(j) for every parcel within the circle that has an index of `begin` or more. None of these was,
// at the sort, in a row of cells before that of y = lowest.
template <Boundary kBoundary, int kRowsOfLoop, bool kReadOnly, class Visit>
__device__ __forceinline__ void search_rows(const DeviceSearch& space, const Vec2i* position,
                                            const SearchCircle& circle, std::int32_t lowest,
                                            std::uint32_t begin, Visit visit) {
  const OneCircle<kBoundary, kRowsOfLoop, kReadOnly> circles{circle, begin};
  const auto visit_one = [&](unsigned, std::uint32_t j) { visit(j); };
  const auto visit_range = [&](std::uint32_t first, std::uint32_t last) {
    const std::uint32_t from = max(first, begin);
    const ParcelRange range[] = {{from, max(last, from) - from}};
    search_ranges(space, position, circles, range, visit_one);
  };
  const std::int32_t x = circle.centre.x, y = circle.centre.y, reach = circle.reach;
  if (space.all_pairs || reach >= kHalfSide) {
    visit_range(0, space.num_parcels);
    return;
  }
  if (crosses_edge<kBoundary>(space.world, {x - reach, x + reach, y - reach, y + reach})) {
    // Rows do not tell what comes before `begin`.
    visit_candidate_ranges<kBoundary>(space.grid, space.cell_start, circle.centre, reach, visit_range);
    return;
  }
  search_box(space, position, circles, {x - reach, x + reach, lowest, y + reach}, true, visit_one);
}

// The same for parcels that come after circle.self in the order of the sort, and so in no row before its own
// at the sort. displacement: bound since the sort, along an axis. Nothing writes positions while the kernel
// runs.
template <Boundary kBoundary, class Visit>
__device__ __forceinline__ void search_later(const DeviceSearch& space, const Vec2i* position,
                                             const SearchCircle& circle, std::int32_t displacement,
                                             Visit visit) {
  search_rows<kBoundary, 2, true>(space, position, circle, circle.centre.y - displacement, circle.self + 1,
                                  visit);
}

// Calls visit(j) for every parcel within the circle but circle.self. position: num_parcels entries, in the
// order of the sort, and kReadBeyond more. kReadOnly: no thread writes them while the kernel runs. kLanes
// consecutive threads may share one search; each sees its share of the parcels.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes = 1, class Visit>
__device__ void search(const DeviceSearch& space, const Vec2i* position, const SearchCircle& circle,
                       Visit visit) {
  if constexpr (kLanes == 1) {
    // A step of 4 10^5 parcels in one kernel makes 21.1 Gps so, with two rows in a loop 20.6 (H200).
    search_rows<kBoundary, 3, kReadOnly>(space, position, circle, circle.centre.y - circle.reach, 0,
                                         [&](std::uint32_t j) {
                                           if (j != circle.self) visit(j);
                                         });
  } else {
    const unsigned lane = threadIdx.x % kLanes;
    const auto visit_range = [&](std::uint32_t first, std::uint32_t last) {
#pragma unroll 2  // a range holds few parcels
      for (std::uint32_t j = first + lane; j < last; j += kLanes) {
        const int2* from = reinterpret_cast<const int2*>(position) + j;
        const int2 there = kReadOnly ? __ldg(from) : *from;
        if (past_circle<kBoundary>(space, circle, there) < 0.0F && j != circle.self) visit(j);
      }
    };
    if (space.all_pairs || circle.reach >= kHalfSide)
      visit_range(0, space.num_parcels);
    else
      visit_candidate_ranges<kBoundary>(space.grid, space.cell_start, circle.centre, circle.reach,
                                        visit_range);
  }
}

#endif

}  // namespace pf
