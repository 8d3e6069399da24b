// List of the contiguous ranges of sorted parcels that a search box covers. (A function object called for
// each range would lack the target attribute of a vectorised search.)
#pragma once

#include <cstdint>
#include <cstdlib>

#include "core/index.hpp"
#include "model/grid.hpp"

namespace pf {

// Entries after the last parcel that a search may read. Their values do not matter.
constexpr std::size_t kSearchPadding = 8;

struct CandidateRanges {
  static constexpr int kMax = 64;
  struct Range {
    std::uint32_t first, last;
  };
  Range at[kMax];
  int num = 0;

  // Stores the ranges of visit_candidate_ranges of model/grid.hpp; all parcels if there are more than kMax.
  template <Boundary kBoundary>
  void list(const GridShape& grid, const std::uint32_t* cell_start, Vec2i position, std::int32_t reach,
            std::uint32_t num_parcels) {
    num = 0;
    visit_candidate_ranges<kBoundary>(grid, cell_start, position, reach,
                                      [&](std::uint32_t first, std::uint32_t last) {
                                        if (num < kMax) at[num] = {first, last};
                                        ++num;
                                      });
    if (num > kMax) list_all(num_parcels);
  }

  void list_all(std::uint32_t num_parcels) {
    at[0] = {0, num_parcels};
    num = 1;
  }
};

// True if the box of half side reach around a position does not cross the edge of a periodic world. Distances
// up to reach then follow from stored positions, without nearest images.
inline bool is_far_from_edge(const World& world, Vec2i position, std::int32_t reach) {
  const auto room = [](std::int32_t coordinate, std::int32_t half) {
    return static_cast<std::int64_t>(half) - std::abs(static_cast<std::int64_t>(coordinate));
  };
  return room(position.x, world.half.x) > reach && room(position.y, world.half.y) > reach;
}

}  // namespace pf
