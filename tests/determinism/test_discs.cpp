// The broad phase of method exact on the CPU: vectorised searches against plain loops, and that no pair is
// missed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "backend/exact/broad_phase.hpp"
#include "backend/exact/positions_at.hpp"
#include "backend/parcel_arrays.hpp"
#include "core/random.hpp"
#include "determinism/disc_gas.hpp"
#include "model/exact/step_plan.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

struct DiscCase {
  std::int64_t n;
  double area_fraction, cell_width;
};
// Few and many parcels; rows of cells hold 1 to more than 24 of them.
constexpr DiscCase kCases[] = {{1, 0.05, 1.0},   {7, 0.15, 1.0},   {40, 0.15, 1.5},  {3000, 0.2, 0.5},
                               {3000, 0.2, 2.8}, {3000, 0.2, 6.0}, {3000, 0.6, 2.0}, {3000, 0.6, 6.0}};
constexpr Boundary kBoundaries[] = {Boundary::open, Boundary::walls, Boundary::periodic};

std::string name(const DiscCase& in, Boundary boundary) {
  return std::to_string(in.n) + " parcels, area fraction " + std::to_string(in.area_fraction) +
         ", cells of " + std::to_string(in.cell_width) + ", boundary " +
         std::to_string(static_cast<int>(boundary));
}

Pairs overlaps(const Gas& gas, const DiscSearch& search, std::uint32_t chunk) {
  Pairs all;
  DiscPairs pairs;
  for (std::uint32_t begin = 0; begin < gas.space.num_parcels; begin += chunk) {
    search.find_pairs(gas.space, begin, std::min(begin + chunk, gas.space.num_parcels), pairs);
    for (const auto [i, j] : pairs.candidates)
      EXPECT_TRUE(all.insert({i, j}).second) << i << ", " << j << " twice";
  }
  return all;
}

Candidates sorted(Candidates candidates) {
  std::sort(candidates.overlapping.begin(), candidates.overlapping.end());
  std::sort(candidates.owned.begin(), candidates.owned.end());
  return candidates;
}

void expect_same(const Candidates& a, const Candidates& b, std::uint32_t i) {
  EXPECT_EQ(sorted(a).overlapping, sorted(b).overlapping) << "of " << i;
  EXPECT_EQ(sorted(a).owned, sorted(b).owned) << "of " << i;
}

// Movers that share a box may find more owned parcels than each alone; all of them are within reach.
void expect_at_least(const Gas& gas, const Mover& mover, const Candidates& both, const Candidates& alone) {
  EXPECT_EQ(sorted(both).overlapping, sorted(alone).overlapping) << "of " << mover.index;
  const std::vector<std::uint32_t> owned = sorted(both).owned, owned_alone = sorted(alone).owned;
  EXPECT_TRUE(std::includes(owned.begin(), owned.end(), owned_alone.begin(), owned_alone.end()))
      << "of " << mover.index;
  const World& world = gas.space.world;
  const auto nearest = [&](double offset, std::int32_t half) {
    return world.boundary == Boundary::periodic ? std::remainder(offset, 2.0 * half) : offset;
  };
  for (const std::uint32_t j : owned) {
    const double x = nearest(gas.discs.x[j] - static_cast<double>(mover.disc.x), world.half.x);
    const double y = nearest(gas.discs.y[j] - static_cast<double>(mover.disc.y), world.half.y);
    EXPECT_NE(gas.owner[j], kInvalidIndex);
    EXPECT_LE(std::hypot(x, y), 1.001 * (mover.disc.radius + gas.space.owned_radius)) << j;
  }
}

TEST(Discs, FastestSearchAgreesWithPlainLoops) {
  for (const Boundary boundary : kBoundaries) {
    const DiscSearch fastest = choose_disc_search(boundary), plain = plain_disc_search(boundary);
    for (const DiscCase& in : kCases) {
      SCOPED_TRACE(name(in, boundary));
      Gas gas(in.n, in.area_fraction, boundary, in.cell_width);
      for (const bool all_pairs : {gas.space.all_pairs, true}) {
        gas.space.all_pairs = all_pairs;
        EXPECT_EQ(overlaps(gas, fastest, 100), overlaps(gas, plain, 64));
        Candidates one, other, two[2];
        for (std::uint32_t i = 0; i < gas.space.num_parcels; i += all_pairs ? 97 : 1) {
          const std::uint32_t next = std::min(i + 1, gas.space.num_parcels - 1);
          if (!gas.is_live(i) || !gas.is_live(next)) continue;
          fastest.find_candidates(gas.space, gas.mover(i), one);
          plain.find_candidates(gas.space, gas.mover(i), other);
          expect_same(one, other, i);
          fastest.find_candidates_of_two(gas.space, {gas.mover(i), gas.mover(next)}, two);
          expect_at_least(gas, gas.mover(i), two[0], other);
          plain.find_candidates(gas.space, gas.mover(next), other);
          expect_at_least(gas, gas.mover(next), two[1], other);
        }
      }
    }
  }
}

// Compares the search with the precise test of all pairs.
template <Boundary kBoundary>
void expect_all_collisions_found(const DiscCase& in) {
  SCOPED_TRACE(name(in, kBoundary));
  const Gas gas(in.n, in.area_fraction, kBoundary, in.cell_width);
  const Pairs found = overlaps(gas, choose_disc_search(kBoundary), 256);
  Candidates candidates;
  int num_collisions = 0, num_turned_collisions = 0;
  for (std::uint32_t i = 0; i < gas.space.num_parcels; ++i) {
    if (!gas.is_live(i)) continue;
    choose_disc_search(kBoundary).find_candidates(gas.space, gas.mover(i), candidates);
    const std::set<std::uint32_t> of_mover(candidates.overlapping.begin(), candidates.overlapping.end());
    const Trajectory turned{gas.position[i], perpendicular(gas.trajectories.velocity[i]), gas.c.plan.start};
    for (std::uint32_t j = 0; j < gas.space.num_parcels; ++j) {
      if (!gas.is_live(j)) continue;
      if (j > i && collision_tick<kBoundary>(gas.c, gas.trajectory(i), gas.trajectory(j)) != kNoTick) {
        ++num_collisions;
        EXPECT_TRUE(found.contains({i, j})) << i << ", " << j;
      }
      if (j != i && collision_tick<kBoundary>(gas.c, turned, gas.trajectory(j)) != kNoTick) {
        ++num_turned_collisions;
        EXPECT_TRUE(of_mover.contains(j)) << i << ", turned, and " << j;
      }
    }
  }
  if (in.n < 1000) return;
  EXPECT_GT(num_collisions, 100);
  EXPECT_GT(num_turned_collisions, 200);
  EXPECT_LT(found.size(), 12U * static_cast<std::size_t>(num_collisions));  // most others are excluded
}

TEST(Discs, OverlapWhereverParcelsCollide) {
  for (const DiscCase& in : kCases) {
    expect_all_collisions_found<Boundary::open>(in);
    expect_all_collisions_found<Boundary::walls>(in);
    expect_all_collisions_found<Boundary::periodic>(in);
  }
}

// A disc at the far end of an owned parcel's longest path, in any direction, is within owned_radius of the
// centre of the parcel's disc.
TEST(Discs, OwnedParcelsAreFoundWhereverTheyMayGo) {
  for (const Boundary boundary : kBoundaries) {
    const Gas gas(3000, 0.2, boundary, 2.8);
    const double path = gas.c.plan.max_speed_mps * gas.c.plan.units_per_tick * gas.c.plan.length;
    Candidates candidates;
    for (std::uint32_t i = 0; i < gas.space.num_parcels; i += 3) {
      if (!gas.is_live(i)) continue;
      const double angle = 0.1 * i;
      const Vec2d path_end{std::cos(angle) * (path + gas.c.run.contact_distance - 4.0),
                           std::sin(angle) * (path + gas.c.run.contact_distance - 4.0)};
      const Vec2i there{static_cast<std::int32_t>(gas.position[i].x + path_end.x),
                        static_cast<std::int32_t>(gas.position[i].y + path_end.y)};
      if (std::abs(there.x) > gas.c.run.physics.world.half.x ||
          std::abs(there.y) > gas.c.run.physics.world.half.y)
        continue;
      choose_disc_search(boundary).find_candidates(
          gas.space, {kInvalidIndex, bounding_disc(there, {}, gas.half_contact())}, candidates);
      std::vector<std::uint32_t> all = candidates.overlapping;
      all.insert(all.end(), candidates.owned.begin(), candidates.owned.end());
      EXPECT_NE(std::find(all.begin(), all.end(), i), all.end()) << i;
    }
  }
}

TEST(Discs, VectorisedAgreeWithSingleOnes) {
  constexpr std::size_t kNum = 1000;
  std::vector<Vec2i> position(kNum);
  std::vector<Vec2f> velocity(kNum);
  std::uint64_t random = 1;
  const auto next = [&] { return random = mix64(random); };
  for (std::size_t i = 0; i < kNum; ++i) {
    position[i] = {static_cast<std::int32_t>(next()) / 2, static_cast<std::int32_t>(next()) / 2};
    velocity[i] = {static_cast<float>(next() % 2001) - 1000.0F, static_cast<float>(next() % 2001) - 1000.0F};
    if (i % 50 == 7) position[i] = {kRetired, 0};
  }
  BoundingDiscs discs;
  discs.resize(kNum);
  const auto check = [&](bool all_finite) {
    for (const auto& [begin, end] : {std::pair{0, 1000}, {3, 998}, {5, 9}}) {
      const SpeedBounds speeds = set_discs({position.data(), velocity.data(), 1e3F, 1e6F}, begin, end, discs);
      float max2 = 0.0F;
      for (int i = begin; i < end; ++i) {
        const float speed2 = dot(velocity[i], velocity[i]);
        const bool counts = !is_retired(position[i]) && speed2 < kMaxFiniteSpeed2;
        EXPECT_EQ(std::isnan(discs.radius[i]), !counts) << i;
        if (!counts) continue;
        const Disc one = bounding_disc(position[i], velocity[i] * 1e3F, 1e6F);
        EXPECT_EQ(std::tuple(discs.x[i], discs.y[i], discs.radius[i]), std::tuple(one.x, one.y, one.radius))
            << i;
        max2 = std::max(max2, speed2);
      }
      EXPECT_EQ(speeds.max2, max2);
      EXPECT_EQ(speeds.all_finite, all_finite || begin > 500 || end <= 100);
    }
  };
  check(true);
  velocity[107].x = std::numeric_limits<float>::infinity();  // retired
  check(true);
  velocity[101].x = std::numeric_limits<float>::quiet_NaN();
  velocity[300].y = std::numeric_limits<float>::infinity();
  check(false);
}

template <Boundary kBoundary>
void expect_positions(const World& world) {
  Settings settings = gas(3000, 0.2, kBoundary);
  SceneRun run(settings);
  RunConstants constants = make_run_constants(run.physics, 0.0);
  constants.physics.world.half = world.half;
  ExactConstants c{constants, {}};
  static_cast<TickScale&>(c.plan) = constants.reference_ticks;
  c.plan.start = 5;
  constexpr std::size_t kNum = 3001;
  std::vector<Vec2i> anchor(kNum), position(kNum);
  std::vector<Vec2f> velocity(kNum);
  std::vector<std::uint32_t> tick(kNum);
  std::uint64_t random = 1;
  const auto next = [&] { return random = mix64(random); };
  const auto random_coordinate = [&](std::int32_t half) {  // every other one is close to an edge
    const auto at = static_cast<std::int32_t>(next() % (2ULL * half) - half);
    return random % 2 == 0 ? at
                           : (at < 0 ? -half : half - 1) +
                                 static_cast<std::int32_t>(random / 2 % 999) * (at < 0 ? 1 : -1);
  };
  int num_at_edge = 0;
  for (const double age : {0.0, 1e3, 1e5, 1e9}) {
    for (std::size_t i = 0; i < kNum; ++i) {
      anchor[i] = {random_coordinate(world.half.x), random_coordinate(world.half.y)};
      if (i % 71 == 3) anchor[i] = {kRetired, 0};
      velocity[i] = {1e-3F * static_cast<float>(next() % 32001) - 16.0F,
                     1e-3F * static_cast<float>(next() % 32001) - 16.0F};
      if (i % 83 == 5) velocity[i].y = std::numeric_limits<float>::infinity();
      tick[i] = c.plan.start - static_cast<std::uint32_t>(age * static_cast<double>(next() % 1000) / 1000.0);
    }
    for (const std::int32_t at : {0, 70000}) {
      std::fill(position.begin(), position.end(), Vec2i{});
      positions_at(c, {anchor.data(), velocity.data(), tick.data()}, at, 1, kNum, position.data());
      EXPECT_EQ(position[0], Vec2i{});
      for (std::size_t i = 1; i < kNum; ++i) {
        const bool is_finite = dot(velocity[i], velocity[i]) < kMaxFiniteSpeed2;
        const Vec2i one =
            is_finite ? position_at<kBoundary>(c, {anchor[i], velocity[i], tick[i]}, at) : anchor[i];
        ASSERT_EQ(position[i], one) << i << ", age " << age << ", boundary " << static_cast<int>(kBoundary);
        if (std::abs(static_cast<std::int64_t>(one.x)) >= world.half.x - wall_radius(c.run)) ++num_at_edge;
      }
    }
  }
  EXPECT_GT(num_at_edge, 100);
}

TEST(PositionsAt, AgreeWithSingleTrajectories) {
  for (const std::int32_t half_y : {kHalfSide, kHalfSide / 3}) {
    World world;
    world.half = {kHalfSide, half_y};
    expect_positions<Boundary::open>(world);
    expect_positions<Boundary::walls>(world);
    expect_positions<Boundary::periodic>(world);
  }
}

}  // namespace
}  // namespace pf::test
