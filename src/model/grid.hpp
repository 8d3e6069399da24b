// The cell grid: the cell of a position, and the ranges of sorted parcels that a search box covers.
//
// Parcels are sorted by row-major cell, so that the cells of one row in a search box are one contiguous
// range. The box is centred on the parcel's current position. Its half side is the contact distance plus the
// largest displacement along an axis of any parcel since the sort. Cell coordinates are monotone in the
// position, so that the box holds every possible partner for any cell width and any age of the sort. Cell
// width and sort interval affect speed alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "model/world.hpp"

namespace pf {

// The cells of one axis.
struct GridAxis {
  std::int32_t half = 0;  // half extent of the world, position units: where a periodic one repeats
  std::int32_t low = 0;   // the cells cover [low, high]; a position beyond counts as at its end
  std::int32_t high = 0;
  std::int32_t num = 1;
  std::uint32_t factor = 0;  // cell = ((position - low) * factor) >> 32

  bool operator==(const GridAxis&) const = default;
};

struct GridShape {
  GridAxis x, y;

  bool operator==(const GridShape&) const = default;

  PF_HD std::uint32_t num_cells() const {
    return static_cast<std::uint32_t>(x.num) * static_cast<std::uint32_t>(y.num);
  }
};

// The part of the world that a grid covers, position units.
struct GridArea {
  Vec2i low, high;
};

inline GridArea area_of(const World& world) { return {{-world.half.x, -world.half.y}, world.half}; }

// num_x, num_y: at least 1; their product fits 31 bits.
inline GridShape make_grid(const World& world, const GridArea& area, std::int32_t num_x, std::int32_t num_y) {
  const auto axis = [](std::int32_t half, std::int32_t low, std::int32_t high, std::int32_t num) {
    // Rounded down with one unit to spare, so that the largest offset, high - low, lies in cell num - 1.
    const std::uint64_t extent = static_cast<std::uint64_t>(static_cast<std::int64_t>(high) - low);
    const std::uint64_t factor = (static_cast<std::uint64_t>(num) << 32) / (extent + 1ULL);
    return GridAxis{half, low, high, num, static_cast<std::uint32_t>(factor)};
  };
  return {axis(world.half.x, area.low.x, area.high.x, num_x),
          axis(world.half.y, area.low.y, area.high.y, num_y)};
}

// Smallest size of cells, and largest number of cells for a parcel.
struct CellSize {
  double width_units = 0.0;
  double per_parcel = 2.0;
  double height_units = width_units;
};

// A grid over an area with so many parcels. There is at least one cell.
inline GridShape choose_grid(const World& world, const GridArea& area, std::uint32_t num_parcels,
                             const CellSize& cells) {
  const double extent_x = static_cast<double>(area.high.x) - area.low.x;
  const double extent_y = static_cast<double>(area.high.y) - area.low.y;
  // If cells would be too many, both sides grow by the same factor; in a flat world one of them cannot.
  const double max_cells = cells.per_parcel * (num_parcels + 1.0);
  const double min_area = extent_x * extent_y / max_cells;
  const double width = std::max(cells.width_units, 1.0), height = std::max(cells.height_units, 1.0);
  const double scale = std::sqrt(std::max(min_area / (width * height), 1.0));
  const auto num = [=](double extent, double side) {
    const double fit = std::min(extent / (side * scale), max_cells);
    return static_cast<std::int32_t>(fit < 1.0 ? 1.0 : fit);
  };
  return make_grid(world, area, num(extent_x, width), num(extent_y, height));
}

// The same over the whole world.
inline GridShape choose_grid(const World& world, std::uint32_t num_parcels, const CellSize& cells) {
  return choose_grid(world, area_of(world), num_parcels, cells);
}

// position: any 32-bit value.
PF_HD inline std::int32_t cell_coordinate(std::int32_t position, const GridAxis& axis) {
  const std::int32_t below = position < axis.high ? position : axis.high;
  const std::int32_t inside = below > axis.low ? below : axis.low;
  const std::uint32_t offset = static_cast<std::uint32_t>(inside) - static_cast<std::uint32_t>(axis.low);
  return static_cast<std::int32_t>((static_cast<std::uint64_t>(offset) * axis.factor) >> 32);
}

// Row-major cell of a position. Retired parcels get num_cells(), one past the last cell.
PF_HD inline std::uint32_t cell_key(const GridShape& grid, Vec2i position) {
  if (is_retired(position)) return grid.num_cells();
  return static_cast<std::uint32_t>(cell_coordinate(position.y, grid.y)) *
             static_cast<std::uint32_t>(grid.x.num) +
         static_cast<std::uint32_t>(cell_coordinate(position.x, grid.x));
}

// Cells of one axis that [position - reach, position + reach] touches: first to last. Where the interval
// crosses a periodic edge, second_first to second_last as well (empty: second_first > second_last).
struct CellSpan {
  std::int32_t first, last;
  std::int32_t second_first, second_last;
};

// |position| + reach must stay below 2^31.
template <Boundary kBoundary>
PF_HD inline CellSpan cell_span(std::int32_t position, std::int32_t reach, const GridAxis& axis) {
  const std::int32_t low = position - reach;
  const std::int32_t high = position + reach;
  CellSpan span{cell_coordinate(low, axis), cell_coordinate(high, axis), 1, 0};
  if constexpr (kBoundary == Boundary::periodic) {
    const std::int32_t half = axis.half;
    if (reach >= half) return {0, axis.num - 1, 1, 0};
    if (low < -half) {
      span.second_first = cell_coordinate(low + half + half, axis);
      span.second_last = axis.num - 1;
      span.first = 0;
      if (span.second_first <= span.last) return {0, axis.num - 1, 1, 0};
    } else if (high >= half) {
      span.second_first = 0;
      span.second_last = cell_coordinate(high - half - half, axis);
      span.last = axis.num - 1;
      if (span.second_last >= span.first) return {0, axis.num - 1, 1, 0};
    }
  }
  return span;
}

// Calls visit(first, end) once for each contiguous range of sorted parcels that may hold partners of a parcel
// at position. cell_start: num_cells() + 1 entries, the first sorted index of each cell.
template <Boundary kBoundary, class Visit>
PF_HD inline void visit_candidate_ranges(const GridShape& grid, const std::uint32_t* cell_start,
                                         Vec2i position, std::int32_t reach, Visit&& visit) {
  const CellSpan sx = cell_span<kBoundary>(position.x, reach, grid.x);
  const CellSpan sy = cell_span<kBoundary>(position.y, reach, grid.y);
  const auto visit_rows = [&](std::int32_t first_row, std::int32_t last_row) {
    if (first_row > last_row) return;
    const auto width = static_cast<std::uint32_t>(grid.x.num);
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
