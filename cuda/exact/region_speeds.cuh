// Method `exact` on the device: bounds on the speeds of parcels by regions of the plane.
//
// A search circle grows with the speed of what it looks for, and in the layer before a ball parcels are ten
// times as fast as elsewhere. So where there is a ball each region, a few cells, has a bound of its own: no
// parcel that lay in it at the sort has been faster since, up to the last commit. The searches at a step's
// start rest on these bounds; those of solvers, while speeds change, on the bound of the step.
#pragma once

#include "cuda/exact/region_grid.hpp"
#include "cuda/exact/step_context.cuh"

namespace pf::cuda {

// Calls visit(bound) for each region that the square around a position touches. bound: square of a speed,
// (m/s)^2, as the bits of a float.
template <Boundary kBoundary, class Visit>
__device__ void visit_regions(const StepContext& step, Vec2i at, std::int32_t reach, Visit visit) {
  const GridShape& grid = step.launch.space.grid;
  const std::uint32_t num_columns = num_region_columns(grid);
  const CellSpan x = cell_span<kBoundary>(at.x, reach, grid.x), y = cell_span<kBoundary>(at.y, reach, grid.y);
  const auto visit_row = [&](std::uint32_t* bounds, std::int32_t first, std::int32_t last) {
    for (std::int32_t k = first / kRegionColumns; k <= last / kRegionColumns; ++k) visit(bounds[k]);
  };
  const auto visit_rows = [&](std::int32_t first, std::int32_t last) {
    for (std::int32_t row = first / kRegionRows; row <= last / kRegionRows; ++row) {
      std::uint32_t* bounds = step.memory.region_speed2 + static_cast<std::uint32_t>(row) * num_columns;
      visit_row(bounds, x.first, x.last);
      if (x.second_first <= x.second_last) visit_row(bounds, x.second_first, x.second_last);
    }
  };
  visit_rows(y.first, y.last);
  if (y.second_first <= y.second_last) visit_rows(y.second_first, y.second_last);
}

// Raises the bounds of the regions that a square touches. speed2: (m/s)^2.
template <Boundary kBoundary>
__device__ void raise_bounds(const StepContext& step, Vec2i at, std::int32_t reach, float speed2) {
  if (step.memory.region_speed2 == nullptr) return;
  const std::uint32_t bits = __float_as_uint(speed2);
  visit_regions<kBoundary>(step, at, reach, [&](std::uint32_t& bound) {
    if (load_fresh(&bound) < bits) atomicMax(&bound, bits);
  });
}

// Raises the bound where a parcel lay at the sort. anchor: of a trajectory that began in the window.
// fastest2: of its speeds since the last commit, (m/s)^2.
template <Boundary kBoundary>
__device__ void raise_bound_of(const StepContext& step, Vec2i anchor, float fastest2) {
  const double moved = step.c.plan.max_speed_mps * step.c.plan.units_per_tick * step.state.window_end;
  raise_bounds<kBoundary>(step, anchor, step.search_reach(moved + kRoundingMargin), fastest2);
}

// The area that a search around a parcel must cover.
struct SearchExtent {
  float radius;        // position units
  std::int32_t reach;  // half side of the search box
};

// Extent of a search for all parcels that a parcel of speed own_mps may touch in the step. other_max_mps:
// bound on the speed of any other.
__device__ inline SearchExtent search_extent(const StepContext& step, float own_mps, float other_max_mps) {
  const float radius = search_radius(step.c, own_mps + other_max_mps);
  return {radius, step.search_reach(radius)};
}

// The same with the bounds of the regions around parcel i, at the step's start. kReadOnly: nothing of the
// kernel has changed them.
template <Boundary kBoundary, bool kReadOnly>
__device__ SearchExtent search_extent_here(const StepContext& step, std::uint32_t i, float own_mps,
                                           float other_max_mps) {
  const SearchExtent anywhere = search_extent(step, own_mps, other_max_mps);
  if (step.memory.region_speed2 == nullptr || anywhere.reach >= kHalfSide) return anywhere;
  std::uint32_t fastest2 = 0;
  visit_regions<kBoundary>(step, step.start_positions()[i], anywhere.reach, [&](std::uint32_t& bound) {
    fastest2 = max(fastest2, kReadOnly ? bound : load_fresh(&bound));
  });
  const float near_mps = fminf(sqrtf(__uint_as_float(fastest2)) * (1.0F + 1e-6F), other_max_mps);
  const float radius = search_radius(step.c, own_mps + near_mps);
  return {radius, min(step.search_reach(radius, near_mps), anywhere.reach)};
}

}  // namespace pf::cuda
