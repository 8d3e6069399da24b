// Method `exact` on the device: the regions of a grid, for host and device.
#pragma once

#include <cstddef>

#include "model/grid.hpp"

namespace pf::cuda {

// Cells of a region.
constexpr std::int32_t kRegionColumns = 8, kRegionRows = 4;

PF_HD inline std::uint32_t num_region_columns(const GridShape& grid) {
  return static_cast<std::uint32_t>((grid.x.num + kRegionColumns - 1) / kRegionColumns);
}

inline std::size_t num_regions(const GridShape& grid) {
  const auto num_rows = static_cast<std::size_t>((grid.y.num + kRegionRows - 1) / kRegionRows);
  return num_region_columns(grid) * num_rows;
}

}  // namespace pf::cuda
