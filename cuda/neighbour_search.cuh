// Search for the parcels near a position: loops over the cells that a search box covers.
#pragma once

#if defined(__CUDACC__)
#include "cuda/architecture.cuh"
#include "cuda/half_warp.cuh"
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

// Less than zero for a position within the circle.
template <Boundary kBoundary>
__device__ __forceinline__ float past_circle(const DeviceSearch& space, const SearchCircle& circle,
                                             int2 there) {
  const Vec2i offset = separation<kBoundary>(space.world, circle.centre, {there.x, there.y});
  const float x = static_cast<float>(offset.x);
  const float y = static_cast<float>(offset.y);
  return __fmaf_rn(x, x, __fmaf_rn(y, y, -circle.radius2));
}

// Indices [first, first + count) of sorted parcels.
struct ParcelRange {
  std::uint32_t first, count;
};

// Positions that search_ranges() reads at a time, the last ones up to three beyond the end of a range.
constexpr unsigned kReadTogether = 4;

// Calls visit(j) for every parcel of two ranges within the circle. The ranges are one loop, so that a thread
// goes on with the second one while others of its warp still are in their first: with parcels read by twos
// the loop has 5.6 turns instead of 7.4 (gas, area fraction 0.2), by fours 3.4. Nothing writes positions
// while the kernel runs.
template <Boundary kBoundary, class Visit>
__device__ __forceinline__ void search_ranges(const DeviceSearch& space, const Vec2i* position,
                                              const SearchCircle& circle, const ParcelRange& one,
                                              const ParcelRange& two, Visit visit) {
  // The loop's index k counts through both ranges, the first one filled up to whole turns.
  const std::uint32_t end_one = (one.count + kReadTogether - 1) / kReadTogether * kReadTogether;
  const std::uint32_t end = end_one + two.count;
  const std::uint32_t first_two = two.first - end_one;
  for (std::uint32_t k = 0; k < end;) {
    const std::uint32_t next = min(end, k + 32);
    std::uint32_t near = 0;  // a bit for each of the last 32, the lowest for k - 1
#pragma unroll 1
    do {
      const std::uint32_t j = k + (k < end_one ? one.first : first_two);
      const int2* from = reinterpret_cast<const int2*>(position) + j;
      int2 there[kReadTogether];
#pragma unroll
      for (unsigned u = 0; u < kReadTogether; ++u) there[u] = __ldg(from + u);
#pragma unroll
      for (unsigned u = 0; u < kReadTogether; ++u) {
        const float past = past_circle<kBoundary>(space, circle, there[u]);
        // Its sign: a comparison would take three instructions.
        near = __funnelshift_l(__float_as_uint(past), near, 1);
      }
      k += kReadTogether;
    } while (k < next);
    while (near != 0) {
      const auto bit = static_cast<std::uint32_t>(31 - __clz(static_cast<int>(near)));
      near ^= 1U << bit;
      const std::uint32_t at = k - 1 - bit;
      const bool in_one = at < end_one;
      if (at < (in_one ? one.count : end)) visit(at + (in_one ? one.first : first_two));
    }
  }
}

// Calls visit(j) for every parcel within the circle that has an index of `begin` or more. None of these was,
// at the sort, in a row of cells before that of y = lowest. Nothing writes positions while the kernel runs.
template <Boundary kBoundary, class Visit>
__device__ __forceinline__ void search_rows(const DeviceSearch& space, const Vec2i* position,
                                            const SearchCircle& circle, std::int32_t lowest,
                                            std::uint32_t begin, Visit visit) {
  const auto not_before = [&](std::uint32_t first, std::uint32_t last) {
    const std::uint32_t from = max(first, begin);
    return ParcelRange{from, max(last, from) - from};
  };
  const auto visit_range = [&](std::uint32_t first, std::uint32_t last) {
    search_ranges<kBoundary>(space, position, circle, not_before(first, last), {}, visit);
  };
  const GridShape& grid = space.grid;
  const std::int32_t x = circle.centre.x, y = circle.centre.y, reach = circle.reach;
  if (space.all_pairs || reach >= kHalfSide) {
    visit_range(0, space.num_parcels);
    return;
  }
  const Vec2i half = space.world.half;
  if (kBoundary == Boundary::periodic &&
      (x - reach < -half.x || x + reach >= half.x || y - reach < -half.y || y + reach >= half.y)) {
    // The box crosses an edge: rows do not tell what comes before `begin`.
    visit_candidate_ranges<kBoundary>(grid, space.cell_start, circle.centre, reach, visit_range);
    return;
  }
  const auto row_length = static_cast<std::uint32_t>(grid.x.num);
  const std::int32_t last_row = cell_coordinate(y + reach, grid.y);
  std::int32_t row = cell_coordinate(lowest, grid.y);
  // Three rows would be two loops. Often the first one ends before `begin`.
  if (last_row - row > 1 && space.cell_start[static_cast<std::uint32_t>(row + 1) * row_length] < begin) ++row;
  const std::int32_t column = cell_coordinate(x - reach, grid.x);
  const auto num_columns = static_cast<std::uint32_t>(cell_coordinate(x + reach, grid.x) - column + 1);
  std::uint32_t cell = static_cast<std::uint32_t>(row) * row_length + static_cast<std::uint32_t>(column);
  const auto range_in_row = [&](std::uint32_t first_cell) {
    return not_before(space.cell_start[first_cell], space.cell_start[first_cell + num_columns]);
  };
  for (std::int32_t num_rows = last_row - row; num_rows >= 0; num_rows -= 2) {
    const std::uint32_t next_row = num_rows > 0 ? cell + row_length : cell;
    const ParcelRange one = range_in_row(cell);
    ParcelRange two = range_in_row(next_row);
    if (num_rows == 0) two.count = 0;
    search_ranges<kBoundary>(space, position, circle, one, two, visit);
    cell = next_row + row_length;
  }
}

// The same for parcels that come after circle.self in the order of the sort, and so in no row before its own
// at the sort. displacement: bound since the sort, along an axis.
template <Boundary kBoundary, class Visit>
__device__ __forceinline__ void search_later(const DeviceSearch& space, const Vec2i* position,
                                             const SearchCircle& circle, std::int32_t displacement,
                                             Visit visit) {
  search_rows<kBoundary>(space, position, circle, circle.centre.y - displacement, circle.self + 1, visit);
}

// Calls visit(j) for every parcel within the circle but circle.self. position: num_parcels entries, in the
// order of the sort. kReadOnly: no thread writes them while the kernel runs; then kReadBeyond entries more.
// kLanes consecutive threads may share one search; each sees its share of the parcels.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes = 1, class Visit>
__device__ void search(const DeviceSearch& space, const Vec2i* position, const SearchCircle& circle,
                       Visit visit) {
  if constexpr (kReadOnly && kLanes == 1) {
    search_rows<kBoundary>(space, position, circle, circle.centre.y - circle.reach, 0, [&](std::uint32_t j) {
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

// The cells of a search box by rows, for threads that share its ranges of sorted parcels among them.
struct SearchBox {
  CellSpan x, y;
  unsigned num_ranges;
};

template <Boundary kBoundary>
__device__ __forceinline__ SearchBox box_around(const DeviceSearch& space, Vec2i at, std::int32_t reach) {
  const GridShape& grid = space.grid;
  if (space.all_pairs) return {{0, 0, 1, 0}, {0, 0, 1, 0}, 1};
  SearchBox box;
  box.x = cell_span<kBoundary>(at.x, reach, grid.x);
  box.y = cell_span<kBoundary>(at.y, reach, grid.y);
  box.num_ranges = static_cast<unsigned>(box.y.last - box.y.first + 1);
  if (box.y.second_last >= box.y.second_first)
    box.num_ranges += static_cast<unsigned>(box.y.second_last - box.y.second_first + 1);
  if (box.x.second_last >= box.x.second_first) box.num_ranges *= 2;
  return box;
}

// The k-th range of a box; beyond the last an empty one.
__device__ __forceinline__ ParcelRange range_of(const DeviceSearch& space, const SearchBox& box, unsigned k) {
  if (k >= box.num_ranges) return {0, 0};
  if (space.all_pairs) return {0, space.num_parcels};
  const bool two = box.x.second_last >= box.x.second_first;
  const int row_in_box = static_cast<int>(two ? k / 2 : k), num_first = box.y.last - box.y.first + 1;
  const int row =
      row_in_box < num_first ? box.y.first + row_in_box : box.y.second_first + (row_in_box - num_first);
  const bool second = two && k % 2 != 0;
  const std::uint32_t* starts =
      space.cell_start + static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(space.grid.x.num);
  const std::uint32_t first = starts[second ? box.x.second_first : box.x.first];
  return {first, starts[(second ? box.x.second_last : box.x.last) + 1] - first};
}

// The candidates of a box, one after the other. kThreads consecutive threads share them: half a warp, or some
// warps. Each half of a warp may have a box of its own, or one without ranges. Whole warps call the
// functions. kAhead: candidates of a thread at a time, to wait for memory once.
template <unsigned kThreads, unsigned kAhead>
class CandidateCursor {
 public:
  __device__ __forceinline__ CandidateCursor(const DeviceSearch& space, const SearchBox& box)
      : space_(space), box_(box), max_ranges_(warp_max(box.num_ranges)) {
    if (max_ranges_ > 0) load_ranges();
  }

  // The same in all threads.
  __device__ __forceinline__ bool has_more() const {
    return next_ < num_candidates_ || base_range_ + kLanes < max_ranges_;
  }

  // Each thread gets kInvalidIndex where it has no candidate left.
  __device__ __forceinline__ void next(std::uint32_t (&j)[kAhead]) {
    if (next_ >= num_candidates_) {
      base_range_ += kLanes;
      load_ranges();
    }
    for (std::uint32_t& index : j) index = kInvalidIndex;
    const unsigned num_ranges = min(max_ranges_ - base_range_, kLanes);
    for (unsigned r = 0; r < num_ranges; ++r) {
      const std::uint32_t r_end = from_lane(end_, r), r_count = from_lane(range_.count, r);
      const std::uint32_t r_first = from_lane(range_.first, r);
      for (unsigned u = 0; u < kAhead; ++u) {
        const std::uint32_t k = next_ + u * kThreads + threadIdx.x % kThreads;
        if (k < r_end && k + r_count >= r_end) j[u] = r_first + (k + r_count - r_end);
      }
    }
    next_ += kAhead * kThreads;
  }

 private:
  static constexpr unsigned kWarp = 0xFFFFFFFFU;
  static constexpr unsigned kLanes = kThreads < 32 ? kThreads : 32;  // that hold the ranges

  static __device__ __forceinline__ std::uint32_t from_lane(std::uint32_t value, unsigned lane) {
    return __shfl_sync(kWarp, value, lane, kLanes);
  }

  // Each lane loads a range.
  __device__ __forceinline__ void load_ranges() {
    range_ = range_of(space_, box_, base_range_ + threadIdx.x % kLanes);
    end_ = range_.count;
    for (unsigned offset = 1; offset < kLanes; offset *= 2) {
      const std::uint32_t before = __shfl_up_sync(kWarp, end_, offset, kLanes);
      if (threadIdx.x % kLanes >= offset) end_ += before;
    }
    num_candidates_ = warp_max(from_lane(end_, kLanes - 1));
    next_ = 0;
  }

  const DeviceSearch& space_;
  SearchBox box_;
  unsigned max_ranges_;
  unsigned base_range_ = 0;
  ParcelRange range_{};
  std::uint32_t end_ = 0;  // of the lane's range, if those of all lanes are laid end to end
  std::uint32_t num_candidates_ = 0, next_ = 0;
};

// Results of one thread's search, in its block's shared memory, kBlock threads wide: a warp works through
// them together after the search instead of one by one inside it.
template <unsigned kBlock>
struct NearList {
  static constexpr unsigned kMax = 12;
  using Space = std::uint32_t[kMax][kBlock];

  Space& space;
  unsigned num = 0;

  // All are counted; the first kMax are kept.
  __device__ void push(std::uint32_t j) {
    if (num < kMax) space[num][threadIdx.x] = j;
    ++num;
  }
  __device__ bool holds_all() const { return num <= kMax; }
  __device__ std::uint32_t operator[](unsigned k) const { return space[k][threadIdx.x]; }
  // Keeps the parcels for which the predicate is true.
  template <class Predicate>
  __device__ void keep_if(Predicate predicate) {
    unsigned kept = 0;
    for (unsigned k = 0; k < num; ++k) {
      const std::uint32_t j = space[k][threadIdx.x];
      if (predicate(j)) space[kept++][threadIdx.x] = j;
    }
    num = kept;
  }
  // The same for predicate(j, load(j)). A value is loaded while the predicate of the parcel before it is
  // found.
  template <class Load, class Predicate>
  __device__ void keep_if(Load load, Predicate predicate) {
    if (num == 0) return;
    unsigned kept = 0;
    std::uint32_t j = space[0][threadIdx.x];
    auto value = load(j);
    for (unsigned k = 0; k < num; ++k) {
      const std::uint32_t next = space[min(k + 1, num - 1)][threadIdx.x];
      const auto next_value = load(next);
      if (predicate(j, value)) space[kept++][threadIdx.x] = j;
      j = next;
      value = next_value;
    }
    num = kept;
  }
};

// The last four results, in registers; all are counted.
struct FindList {
  static constexpr unsigned kMax = 4;
  std::uint32_t j0 = 0, j1 = 0, j2 = 0, j3 = 0;
  unsigned num = 0;

  __device__ void push(std::uint32_t j) {
    j3 = j2;
    j2 = j1;
    j1 = j0;
    j0 = j;
    ++num;
  }
  __device__ std::uint32_t pop() {
    const std::uint32_t j = j0;
    j0 = j1;
    j1 = j2;
    j2 = j3;
    --num;
    return j;
  }
};

#endif

}  // namespace pf
