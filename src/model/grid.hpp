// The cell grid: the cell of a position, and the ranges of sorted parcels that a search box covers.
//
// Parcels are sorted by row-major cell, so that the cells of one row in a search box are one contiguous
// range. The box is centred on the parcel's current position. Its half side is the contact distance plus the
// largest displacement along an axis of any parcel since the sort. Cell coordinates are monotone in the
// position, so that the box holds every possible partner for any cell width and any age of the sort. Cell
// width and sort interval affect speed alone.
#pragma once

#include <cstdint>

#include "model/world.hpp"

namespace pf {

struct GridShape {
  Vec2i half{};            // half extents of the world, position units
  std::int32_t num_x = 1;  // cells along x
  std::int32_t num_y = 1;
  std::uint32_t factor_x = 0;  // cell = (offset * factor) >> 32
  std::uint32_t factor_y = 0;

  bool operator==(const GridShape&) const = default;

  PF_HD std::uint32_t num_cells() const {
    return static_cast<std::uint32_t>(num_x) * static_cast<std::uint32_t>(num_y);
  }
};

// num_x, num_y: 1 to 2^15 - 1, so that their product fits 32 bits.
inline GridShape make_grid(const World& world, std::int32_t num_x, std::int32_t num_y) {
  const auto factor = [](std::int32_t num, std::int32_t half) {
    // Rounded down with one unit to spare, so that the largest offset, 2 half, lies in cell num - 1.
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(num) << 32) /
                                      (2ULL * static_cast<std::uint64_t>(half) + 1ULL));
  };
  return {world.half, num_x, num_y, factor(num_x, world.half.x), factor(num_y, world.half.y)};
}

// A grid of cells at least width_units wide, with at most cells_per_parcel cells per parcel and at least one.
inline GridShape choose_grid(const World& world, std::uint32_t num_parcels, double width_units,
                             double cells_per_parcel = 2.0) {
  const double extent_x = 2.0 * world.half.x;
  const double extent_y = 2.0 * world.half.y;
  const double min_width = std::sqrt(extent_x * extent_y / (cells_per_parcel * (num_parcels + 1.0)));
  const double width = width_units > min_width ? width_units : min_width;
  const auto cells = [width](double extent) {
    const double fit = extent / width;
    return static_cast<std::int32_t>(fit < 1.0 ? 1.0 : fit);
  };
  return make_grid(world, cells(extent_x), cells(extent_y));
}

// position: any 32-bit value. A position beyond the edge counts as at the edge.
PF_HD inline std::int32_t cell_coordinate(std::int32_t position, std::int32_t half, std::uint32_t factor) {
  const std::int32_t inside = position < -half ? -half : (position > half ? half : position);
  const std::uint32_t offset = static_cast<std::uint32_t>(inside) + static_cast<std::uint32_t>(half);
  return static_cast<std::int32_t>((static_cast<std::uint64_t>(offset) * factor) >> 32);
}

// Row-major cell of a position. Retired parcels get num_cells(), one past the last cell.
PF_HD inline std::uint32_t cell_key(const GridShape& grid, Vec2i position) {
  if (is_retired(position)) return grid.num_cells();
  const std::int32_t cx = cell_coordinate(position.x, grid.half.x, grid.factor_x);
  const std::int32_t cy = cell_coordinate(position.y, grid.half.y, grid.factor_y);
  return static_cast<std::uint32_t>(cy) * static_cast<std::uint32_t>(grid.num_x) +
         static_cast<std::uint32_t>(cx);
}

// Cells of one axis that [position - reach, position + reach] touches: first to last. Where the interval
// crosses a periodic edge, second_first to second_last as well (empty: second_first > second_last).
struct CellSpan {
  std::int32_t first, last;
  std::int32_t second_first, second_last;
};

// |position| + reach must stay below 2^31.
template <Boundary kBoundary>
PF_HD inline CellSpan cell_span(std::int32_t position, std::int32_t reach, std::int32_t half,
                                std::int32_t num, std::uint32_t factor) {
  const std::int32_t low = position - reach;
  const std::int32_t high = position + reach;
  CellSpan span{cell_coordinate(low, half, factor), cell_coordinate(high, half, factor), 1, 0};
  if constexpr (kBoundary == Boundary::periodic) {
    if (reach >= half) return {0, num - 1, 1, 0};
    if (low < -half) {
      span.second_first = cell_coordinate(low + half + half, half, factor);
      span.second_last = num - 1;
      span.first = 0;
      if (span.second_first <= span.last) return {0, num - 1, 1, 0};
    } else if (high >= half) {
      span.second_first = 0;
      span.second_last = cell_coordinate(high - half - half, half, factor);
      span.last = num - 1;
      if (span.second_last >= span.first) return {0, num - 1, 1, 0};
    }
  }
  return span;
}

// Calls visit(first, end) once for each contiguous range of sorted parcels that may hold partners of a parcel
// at position. cell_start: num_cells() + 1 entries, the first sorted index of each cell.
template <Boundary kBoundary, class Visit>
PF_HD inline void visit_candidate_ranges(const GridShape& grid, const std::uint32_t* cell_start,
                                         Vec2i position, std::int32_t reach, Visit&& visit) {
  const CellSpan sx = cell_span<kBoundary>(position.x, reach, grid.half.x, grid.num_x, grid.factor_x);
  const CellSpan sy = cell_span<kBoundary>(position.y, reach, grid.half.y, grid.num_y, grid.factor_y);
  const auto visit_rows = [&](std::int32_t first_row, std::int32_t last_row) {
    if (first_row > last_row) return;
    const auto width = static_cast<std::uint32_t>(grid.num_x);
    std::uint32_t base = static_cast<std::uint32_t>(first_row) * width;
    std::uint32_t first = cell_start[base + sx.first], last = cell_start[base + sx.last + 1];
    for (std::int32_t row = first_row; row <= last_row; ++row, base += width) {
      const std::uint32_t next = row < last_row ? base + width : base;  // fetched while this row is visited
      const std::uint32_t next_first = cell_start[next + sx.first],
                          next_last = cell_start[next + sx.last + 1];
      visit(first, last);
      first = next_first;
      last = next_last;
      if constexpr (kBoundary == Boundary::periodic) {
        if (sx.second_first <= sx.second_last) {
          visit(cell_start[base + sx.second_first], cell_start[base + sx.second_last + 1]);
        }
      }
    }
  };
  visit_rows(sy.first, sy.last);
  if constexpr (kBoundary == Boundary::periodic) visit_rows(sy.second_first, sy.second_last);
}

}  // namespace pf
