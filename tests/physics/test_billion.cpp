// A billion parcels, the most that a run takes: the widest values of ids, sites, cells and units, without the
// memory that such a run needs.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "backend/cpu_tally.hpp"
#include "model/contact.hpp"
#include "model/grid.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

constexpr std::uint32_t kBillion = 1'000'000'000;
constexpr std::uint32_t kStride = 100'003;  // prime: some of every row and column

struct Billion {
  explicit Billion(Boundary boundary)
      : settings(gas(kBillion, 0.2, boundary)),
        physics(derive_physics(settings)),
        spawner(settings, physics, initial_ball(settings)) {}

  Parcel parcel(std::uint32_t id) const {
    return spawn_parcel(spawner.plan(), spawner.plan().row_start[spawner.plan().num_rows], id);
  }

  Settings settings;
  Physics physics;
  Spawner spawner;
};

class EachBoundary : public testing::TestWithParam<Boundary> {};

TEST_P(EachBoundary, SpawnsABillionParcelsApartWithoutMomentum) {
  const Billion billion(GetParam());
  const Vec2i half = billion.physics.world.half;
  const double contact = 2.0 * billion.physics.parcels.radius_m / billion.physics.world.unit_m;
  ASSERT_EQ(billion.spawner.plan().num_parcels, kBillion);
  std::set<std::pair<std::int32_t, std::int32_t>> positions;
  Vec2i lowest = half, highest = {-half.x, -half.y};
  for (std::uint32_t id = 0; id < kBillion / 2; id += kStride) {
    const Parcel one = billion.parcel(id), next = billion.parcel(id + 1),
                 other = billion.parcel(id + kBillion / 2);
    for (const Parcel& p : {one, next, other}) {
      positions.insert({p.position.x, p.position.y});
      lowest = {std::min(lowest.x, p.position.x), std::min(lowest.y, p.position.y)};
      highest = {std::max(highest.x, p.position.x), std::max(highest.y, p.position.y)};
    }
    const Vec2d apart = to_double(next.position) - to_double(one.position);
    EXPECT_GE(length(apart), contact) << id;
    EXPECT_EQ(one.velocity.x, -other.velocity.x) << id;
    EXPECT_EQ(one.velocity.y, -other.velocity.y) << id;
  }
  EXPECT_EQ(positions.size(), 3 * ((kBillion / 2 - 1) / kStride + 1));
  EXPECT_LT(lowest.y, -half.y / 10 * 9);  // from the first row to the last
  EXPECT_GT(highest.y, half.y / 10 * 9);
  const Parcel last = billion.parcel(kBillion - 1);
  EXPECT_LE(std::abs(last.position.x), half.x);
  EXPECT_LE(last.position.y, half.y);
}

// As many cells as a GPU has for a parcel, and as a CPU has.
TEST_P(EachBoundary, NumbersTheCellsOfABillionParcels) {
  const Billion billion(GetParam());
  const World& world = billion.physics.world;
  for (const double per_parcel : {1.0, 2.0}) {
    const GridShape grid = choose_grid(world, kBillion, {1.0, per_parcel});
    const std::uint64_t num_cells =
        static_cast<std::uint64_t>(grid.x.num) * static_cast<std::uint64_t>(grid.y.num);
    EXPECT_GT(static_cast<double>(num_cells), 0.99 * per_parcel * kBillion);
    ASSERT_LT(num_cells, std::uint64_t{1} << 31U);
    EXPECT_EQ(grid.num_cells(), num_cells);
    EXPECT_EQ(cell_key(grid, {-world.half.x, -world.half.y}), 0U);
    EXPECT_EQ(cell_key(grid, world.half), num_cells - 1);
    EXPECT_EQ(cell_key(grid, {kRetired, 0}), num_cells);
    for (std::uint32_t id = 0; id < kBillion; id += kStride) {
      const Vec2i at = billion.parcel(id).position;
      const std::uint32_t key = cell_key(grid, at);
      const double column = (static_cast<double>(at.x) + world.half.x) / (2.0 * world.half.x) * grid.x.num;
      const double row = (static_cast<double>(at.y) + world.half.y) / (2.0 * world.half.y) * grid.y.num;
      EXPECT_NEAR(key % static_cast<std::uint32_t>(grid.x.num), column, 1.5) << id;
      EXPECT_NEAR(key / static_cast<std::uint32_t>(grid.x.num), row, 1.5) << id;
    }
  }
}

// A collision of two of them: positions and velocities are fine enough for the contact, and the sums hold it.
TEST_P(EachBoundary, CollidesTwoOfABillion) {
  const Billion billion(GetParam());
  const StepConstants c = make_step_constants(billion.physics, 0.035, 0.0);
  ASSERT_GT(c.contact_distance, 30'000.0);  // position units
  const std::int32_t distance = c.contact_reach / 10 * 9;
  const Parcel one{{0, 0}, {3.0F, 1.0F}, kBillion - 1}, two{{distance, 0}, {-2.0F, 1.0F}, kBillion - 2};
  ContactSums sums, of_other;
  CpuTally tally;
  add_contact<ImpulseContact>(c, one, two, {distance, 0}, sums, tally);
  add_contact<ImpulseContact>(c, two, one, {-distance, 0}, of_other, tally);
  const double change = 0.5 * (1.0 + billion.physics.parcels.restitution) * 5.0;
  EXPECT_NEAR(static_cast<double>(sums.velocity_x) * c.velocity_unit_mps, -change, 4.0 * 0x1p-24 * change);
  EXPECT_NEAR(static_cast<double>(sums.push_x) / kPushOutUnit, -0.5 * (c.contact_distance - distance), 1e-3);
  EXPECT_EQ(sums.velocity_x, -of_other.velocity_x);
  EXPECT_EQ(sums.push_x, -of_other.push_x);
  EXPECT_EQ(tally.num_collisions, 1U);
  // A billion contacts of the strongest kind that a tally counts.
  EXPECT_LT(static_cast<double>(kBillion) * impulse_counts(1e30, c.per_impulse_count), 0x1p62);
}

INSTANTIATE_TEST_SUITE_P(Billion, EachBoundary,
                         testing::Values(Boundary::open, Boundary::walls, Boundary::periodic));

}  // namespace
}  // namespace pf::test
