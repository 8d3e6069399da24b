// Which parcels may be near one: the loop over the cells that its search box covers.
#pragma once

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

// Calls found(j, offset) for every parcel j but i within the distance whose square is filter_distance2 of
// here. position: one for each parcel, in the order of the sort. kReadOnly: nothing writes it while the
// kernel runs.
// reach: that of the search box; from kHalfSide on, more than a box can hold, it is the whole world.
// kLanes threads in a row may share one search: each sees its share of the candidates.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes = 1, class Found>
__device__ void search(const DeviceSearch& space, const Vec2i* position, Vec2i here, std::uint32_t i,
                       std::int32_t reach, float filter_distance2, Found found) {
  const unsigned lane = threadIdx.x % kLanes;
  const auto visit = [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t j = first + lane; j < last; j += kLanes) {
      const int2* from = reinterpret_cast<const int2*>(position) + j;
      const int2 there = kReadOnly ? __ldg(from) : *from;
      const Vec2i offset = separation<kBoundary>(space.world, here, {there.x, there.y});
      const float x = static_cast<float>(offset.x);
      const float y = static_cast<float>(offset.y);
      if (x * x + y * y < filter_distance2 && j != i) found(j, offset);
    }
  };
  if (space.all_pairs || reach >= kHalfSide) {
    visit(0, space.num_parcels);
  } else {
    visit_candidate_ranges<kBoundary>(space.grid, space.cell_start, here, reach, visit);
  }
}

// The cells of a search box by rows, for threads that share out their ranges of sorted parcels.
struct SearchBox {
  CellSpan x, y;
  unsigned num_ranges;
};
struct CandidateRange {
  std::uint32_t first, count;
};

template <Boundary kBoundary>
__device__ __forceinline__ SearchBox box_around(const DeviceSearch& space, Vec2i at, std::int32_t reach) {
  const GridShape& grid = space.grid;
  if (space.all_pairs) return {{0, 0, 1, 0}, {0, 0, 1, 0}, 1};
  SearchBox box;
  box.x = cell_span<kBoundary>(at.x, reach, grid.half.x, grid.num_x, grid.factor_x);
  box.y = cell_span<kBoundary>(at.y, reach, grid.half.y, grid.num_y, grid.factor_y);
  box.num_ranges = static_cast<unsigned>(box.y.last - box.y.first + 1);
  if (box.y.second_last >= box.y.second_first)
    box.num_ranges += static_cast<unsigned>(box.y.second_last - box.y.second_first + 1);
  if (box.x.second_last >= box.x.second_first) box.num_ranges *= 2;
  return box;
}

// The k-th range of a box; beyond the last an empty one.
__device__ __forceinline__ CandidateRange range_of(const DeviceSearch& space, const SearchBox& box,
                                                   unsigned k) {
  if (k >= box.num_ranges) return {0, 0};
  if (space.all_pairs) return {0, space.num_parcels};
  const bool two = box.x.second_last >= box.x.second_first;
  const int row_in_box = static_cast<int>(two ? k / 2 : k), num_first = box.y.last - box.y.first + 1;
  const int row =
      row_in_box < num_first ? box.y.first + row_in_box : box.y.second_first + (row_in_box - num_first);
  const bool second = two && k % 2 != 0;
  const std::uint32_t* starts =
      space.cell_start + static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(space.grid.num_x);
  const std::uint32_t first = starts[second ? box.x.second_first : box.x.first];
  return {first, starts[(second ? box.x.second_last : box.x.last) + 1] - first};
}

// Finds of one thread's search, in its block's shared memory, kBlock threads wide: a warp works through them
// together after the search instead of one by one inside it.
template <unsigned kBlock>
struct NearList {
  static constexpr unsigned kMax = 12;
  using Space = std::uint32_t[kMax][kBlock];

  Space& space;
  unsigned num = 0;

  // All are counted, the first kMost kept.
  __device__ void push(std::uint32_t j) {
    if (num < kMax) space[num][threadIdx.x] = j;
    ++num;
  }
  __device__ bool holds_all() const { return num <= kMax; }
  __device__ std::uint32_t operator[](unsigned k) const { return space[k][threadIdx.x]; }
  // Keeps those that the predicate is true for.
  template <class Predicate>
  __device__ void keep_if(Predicate predicate) {
    unsigned kept = 0;
    for (unsigned k = 0; k < num; ++k) {
      const std::uint32_t j = space[k][threadIdx.x];
      if (predicate(j)) space[kept++][threadIdx.x] = j;
    }
    num = kept;
  }
};

// Up to four finds kept in registers, so that a warp's few are worked through together after its search
// instead of one by one inside it.
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
