// The parallel counting sort against std::stable_sort.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "backend/parcel_arrays.hpp"
#include "core/random.hpp"

namespace pf::test {
namespace {

GridShape some_grid(std::uint32_t num_parcels) {
  World world;
  world.half = {1 << 30, 1 << 29};
  return choose_grid(world, num_parcels, {num_parcels > 3000 ? 1e7 : 5e7});
}

// Some of them retired, some in a crowd, some heated; with all arrays that a method may have.
ParcelArrays random_parcels(std::uint32_t num) {
  ParcelArrays parcels;
  parcels.resize(num);
  for (std::uint32_t i = 0; i < num; ++i) {
    const double x = uniform(random_bits(7, i, 0)), y = uniform(random_bits(7, i, 1));
    const double width = i % 5 == 0 ? 0.05 : 1.0;
    parcels.position[i] = {static_cast<std::int32_t>((2.0 * x - 1.0) * width * 0x1p30),
                           static_cast<std::int32_t>((2.0 * y - 1.0) * width * 0x1p29)};
    if (i % 97 == 3) parcels.position[i] = {kRetired, 0};
    parcels.velocity[i] = {static_cast<float>(i), -1.0F};
    parcels.id[i] = i;
    parcels.is_heated[i] = i % 11 == 2 ? 1 : 0;
    parcels.tick.push_back(3 * i);
    parcels.last_contact_tick.push_back(5 * i + 1);
    parcels.slot.push_back(i % 13 == 0 ? i : 0);
  }
  return parcels;
}

std::vector<std::uint32_t> stable_order(const GridShape& grid, const ParcelArrays& parcels) {
  std::vector<std::uint32_t> order(parcels.id.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
    return cell_key(grid, parcels.position[i]) < cell_key(grid, parcels.position[j]);
  });
  return order;
}

ParcelArrays in_order(const ParcelArrays& parcels, const std::vector<std::uint32_t>& order) {
  ParcelArrays sorted;
  sorted.resize(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    sorted.position[k] = parcels.position[order[k]];
    sorted.velocity[k] = parcels.velocity[order[k]];
    sorted.id[k] = parcels.id[order[k]];
    sorted.is_heated[k] = parcels.is_heated[order[k]];
    sorted.tick.push_back(parcels.tick[order[k]]);
    sorted.last_contact_tick.push_back(parcels.last_contact_tick[order[k]]);
    sorted.slot.push_back(parcels.slot[order[k]]);
  }
  return sorted;
}

// in_all_parts: as many slices are sorted side by side as the parcels have parts.
void expect_sorted(unsigned num_threads, const GridShape& grid, const ParcelArrays& parcels,
                   bool in_all_parts) {
  const std::size_t num = parcels.id.size();
  const ParcelArrays wanted = in_order(parcels, stable_order(grid, parcels));
  ThreadTeam team(num_threads);
  CellSort cell_sort;
  PhaseTimes times;
  ParcelArrays sorted;
  sorted.resize(num);
  std::vector<std::uint32_t> cell_start;
  for (int repeat = 0; repeat < 2; ++repeat) {  // counts of the first time are there in the second
    cell_sort.sort(team, {grid, parcels.position.data(), parcels}, {sorted, cell_start}, times);
    EXPECT_EQ(sorted.id, wanted.id);
    EXPECT_EQ(sorted.is_heated, wanted.is_heated);
    EXPECT_EQ(sorted.tick, wanted.tick);
    EXPECT_EQ(sorted.last_contact_tick, wanted.last_contact_tick);
    EXPECT_EQ(sorted.slot, wanted.slot);
    EXPECT_TRUE(std::equal(wanted.position.begin(), wanted.position.begin() + num, sorted.position.begin()));
    EXPECT_TRUE(std::equal(wanted.velocity.begin(), wanted.velocity.begin() + num, sorted.velocity.begin()));
    ASSERT_EQ(cell_start.size(), grid.num_cells() + 2U);
    for (std::uint32_t key = 0; key <= grid.num_cells(); ++key) {
      const auto first = std::partition_point(wanted.position.begin(), wanted.position.begin() + num,
                                              [&](Vec2i p) { return cell_key(grid, p) < key; });
      ASSERT_EQ(cell_start[key], first - wanted.position.begin()) << "cell " << key;
    }
    EXPECT_EQ(cell_start.back(), num);
  }
  const std::size_t num_parts = team.num_parts(num, min_parcels_together(grid, num));
  EXPECT_TRUE(num < 30'000 || num_threads == 1 || num_parts > num_threads);
  if (in_all_parts) {
    EXPECT_EQ(cell_sort.num_slices(), num_parts);
  }
}

// With more threads than there are counts for, parcels in any order make slices share them; those that lie
// almost in order do not.
TEST(CellSort, IsStableForAnyOrderAndNumberOfThreads) {
  for (const std::uint32_t num : {0U, 1U, 3U, 3000U, 60'000U}) {
    const GridShape grid = some_grid(num);
    const ParcelArrays any_order = random_parcels(num);
    const ParcelArrays sorted = in_order(any_order, stable_order(grid, any_order));
    ParcelArrays almost = sorted;
    for (std::size_t i = 0; i + 40 < num; i += 7) std::swap(almost.position[i], almost.position[i + 40]);
    ParcelArrays leaving = sorted;  // as in an open world, where each slice loses some between two sorts
    for (std::size_t i = 0; i < num; i += 50) leaving.position[i] = {kRetired, 0};
    for (const unsigned num_threads : {1U, 2U, 4U, 5U, 16U}) {
      if (num > 3000 && num_threads > 5) continue;
      SCOPED_TRACE(std::to_string(num) + " parcels, " + std::to_string(num_threads) + " threads");
      expect_sorted(num_threads, grid, any_order, false);
      expect_sorted(num_threads, grid, sorted, true);
      expect_sorted(num_threads, grid, almost, true);
      expect_sorted(num_threads, grid, leaving, true);
    }
  }
}

}  // namespace
}  // namespace pf::test
