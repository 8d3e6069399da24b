// Method `exact` on the CPU: search boxes that are as wide as the parcels near them are fast, not as the
// fastest of all.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "backend/exact/broad_phase.hpp"

namespace pf {

// Parcels that are predicted one after the other, and the box around their positions. It reaches an edge if
// one has retired.
struct Chunk {
  std::uint32_t number, size, begin, end;
  Vec2i low{INT32_MAX, INT32_MAX}, high{-INT32_MAX, -INT32_MAX};

  // Chunk `number` of parcels that are sorted by these positions, in chunks of `size`.
  Chunk(const Vec2i* position, std::uint32_t num_parcels, std::uint32_t in_number, std::uint32_t in_size)
      : number(in_number), size(in_size), begin(number * size), end(std::min(begin + size, num_parcels)) {
    for (std::uint32_t i = begin; i < end; ++i) {
      low = {std::min(low.x, position[i].x), std::min(low.y, position[i].y)};
      high = {std::max(high.x, position[i].x), std::max(high.y, position[i].y)};
    }
    low.x = std::max(low.x, -INT32_MAX);  // not that of a retired parcel
  }
};

inline std::int32_t saturated_coordinate(std::int64_t coordinate) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(coordinate, -INT32_MAX, INT32_MAX));
}

// Reach of search boxes that find all pairs of a chunk's parcels with parcels of higher index: that of the
// fastest parcel of all chunks from which one may come. speed2: largest squared speed in each chunk.
template <Boundary kBoundary>
std::int32_t reach_from(const ExactConstants& c, const DiscSpace& space, const std::vector<float>& speed2,
                        const Chunk& chunk) {
  const GridShape& grid = space.grid;
  const std::int64_t widest = std::int64_t{reach_of(c, std::sqrt(speed2[chunk.number]))} + space.reach;
  const std::int32_t left = saturated_coordinate(chunk.low.x - widest);
  const std::int32_t right = saturated_coordinate(chunk.high.x + widest);
  const std::int32_t bottom = saturated_coordinate(chunk.low.y - widest);  // of images only
  const std::int32_t top = saturated_coordinate(chunk.high.y + widest);
  const Vec2i half = space.world.half;
  const bool has_images = kBoundary == Boundary::periodic &&
                          (left < -half.x || right >= half.x || bottom < -half.y || top >= half.y);
  if (space.all_pairs || has_images) return space.reach;
  float fastest2 = 0.0F;
  const std::int32_t last_row = cell_coordinate(top, grid.y);
  for (std::int32_t row = cell_coordinate(chunk.low.y, grid.y); row <= last_row; ++row) {
    const std::uint32_t* starts = space.cell_start + static_cast<std::ptrdiff_t>(row) * grid.x.num;
    const std::uint32_t first = starts[cell_coordinate(left, grid.x)];
    const std::uint32_t end = starts[cell_coordinate(right, grid.x) + 1];
    for (std::uint32_t k = first / chunk.size; k * chunk.size < end; ++k)
      fastest2 = std::max(fastest2, speed2[k]);
  }
  return std::min(space.reach, reach_of(c, std::sqrt(fastest2)));
}

}  // namespace pf
