// Search for the parcels near a position by threads that share the cells which a search box covers; lists of
// parcels that are found.
#pragma once

#include "cuda/circle_search.cuh"
#if defined(__CUDACC__)
#include "cuda/half_warp.cuh"
#endif

namespace pf {

#if defined(__CUDACC__)

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
