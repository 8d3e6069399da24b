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

}  // namespace
}  // namespace pf::test
