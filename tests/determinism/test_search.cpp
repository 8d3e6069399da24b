// The fast candidate search against the plain loop.
#include <gtest/gtest.h>

#include <algorithm>

#include "backend/neighbour_search.hpp"
#include "backend/parcel_arrays.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

// Sorted candidates of every parcel.
std::vector<std::vector<std::uint32_t>> candidates_of(const SearchSpace& space, Search search) {
  std::vector<std::vector<std::uint32_t>> all;
  SearchScratch scratch;
  for (std::uint32_t i = 0; i < space.num_parcels; ++i) {
    search(space, i, scratch);
    std::sort(scratch.candidates.begin(), scratch.candidates.end());
    all.push_back(scratch.candidates);
  }
  return all;
}

// The filter is three diameters wide, so that rows hold more than eight candidates, in every vector lane.
TEST(Search, FastSearchEqualsThePlainLoop) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const std::int64_t n : {1, 7, 40, 3000}) {
      SceneRun run(gas(n, n == 1 ? 0.05 : 0.15, boundary));
      const ParcelSnapshot snapshot = run.backend->snapshot();
      ParcelArrays parcels, sorted;
      parcels.resize(snapshot.position.size());
      sorted.resize(snapshot.position.size());
      std::copy(snapshot.position.begin(), snapshot.position.end(), parcels.position.begin());
      const double diameter = 1.0 / run.physics.world.unit_m;
      const double reach = std::min(3.0 * diameter, 0.9 * run.physics.world.half.x);
      for (const double width : {0.5, 2.0}) {
        ThreadTeam team(1);
        CellSort cell_sort;
        PhaseTimes times;
        std::vector<std::uint32_t> cell_start;
        const auto num = static_cast<std::uint32_t>(n);
        const GridShape grid = choose_grid(run.physics.world, num, {width * diameter});
        cell_sort.sort(team, {grid, parcels.position.data(), parcels}, {sorted, cell_start}, times);
        const SearchSpace space{sorted.position.data(),
                                cell_start.data(),
                                grid,
                                run.physics.world,
                                num,
                                static_cast<std::int32_t>(reach),
                                static_cast<float>(reach * reach),
                                false};
        EXPECT_EQ(candidates_of(space, choose_search(boundary)), candidates_of(space, plain_search(boundary)))
            << n << " parcels, boundary " << static_cast<int>(boundary) << ", cells of " << width;
      }
    }
  }
}

// Also in worlds lower than a cell, whose cells cannot grow both ways: arrays of a GPU hold so many.
TEST(Search, GridsHaveAsManyCellsAsAskedForAtMost) {
  for (const double height : {1.0, 0.1, 1e-3, 1e-4, 1e-6}) {
    for (const bool is_flat : {true, false}) {
      World world;
      const auto long_half = std::int32_t{1} << 30;
      const auto short_half = static_cast<std::int32_t>(height * long_half);
      world.half = is_flat ? Vec2i{long_half, short_half} : Vec2i{short_half, long_half};
      for (const std::uint32_t num : {0U, 1U, 1257U, 1'000'000U}) {
        for (const double per_parcel : {1.0, 2.0}) {
          for (const double width_units : {1.0, 1e4, 1e6}) {
            const GridShape grid =
                choose_grid(world, num, {width_units, per_parcel, 7.0 / 3.0 * width_units});
            EXPECT_GE(grid.num_cells(), 1U);
            EXPECT_LE(static_cast<double>(grid.x.num) * grid.y.num, per_parcel * (num + 1.0))
                << height << ", " << num << " parcels, cells of " << width_units;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace pf::test
