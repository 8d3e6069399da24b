// The start of a run: no overlaps, positions around lattice sites, reproducible from the seed.
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

// Smallest distance between parcels over the contact distance, by brute force.
double smallest_gap(SceneRun& run) {
  const ParcelSnapshot s = run.backend->snapshot();
  const World& world = run.physics.world;
  double smallest = 1e300;
  for (std::size_t i = 0; i < s.position.size(); ++i) {
    for (std::size_t j = i + 1; j < s.position.size(); ++j) {
      const Vec2i e = world.boundary == Boundary::periodic
                          ? separation<Boundary::periodic>(world, s.position[i], s.position[j])
                          : separation<Boundary::walls>(world, s.position[i], s.position[j]);
      smallest = std::min(smallest, length(to_double(e)));
    }
  }
  return smallest * world.unit_m / (2.0 * run.physics.parcels.radius_m);
}

// Parcels reach into no wall, and none begins outside.
void expect_within_edges(SceneRun& run) {
  const World& world = run.physics.world;
  const double margin_m = world.boundary == Boundary::periodic ? 0.0 : run.physics.parcels.radius_m;
  for (const Vec2i& p : run.backend->snapshot().position) {
    ASSERT_LE(std::fabs(to_metres(world, p).x), world.half.x * world.unit_m - margin_m);
    ASSERT_LE(std::fabs(to_metres(world, p).y), world.half.y * world.unit_m - margin_m);
  }
}

TEST(Spawn, NothingOverlapsAtAnyDensityAndBoundary) {
  for (const Boundary boundary : {Boundary::walls, Boundary::periodic, Boundary::open}) {
    for (const double fraction : {0.02, 0.2, 0.5, 0.7}) {
      for (const std::int64_t n : {100, 877, 3000}) {
        SceneRun run(gas(n, fraction, boundary));
        EXPECT_GE(smallest_gap(run), 1.0) << n << " parcels at " << fraction;
        expect_within_edges(run);
      }
    }
  }
}

TEST(Spawn, PlacesOneParcel) {
  SceneRun run(gas(1, 0.1));
  EXPECT_EQ(run.backend->measure().num_live, 1U);
}

TEST(Spawn, PlacesFewParcelsApartAndWithinTheEdges) {
  for (const Boundary boundary : {Boundary::walls, Boundary::periodic, Boundary::open}) {
    for (std::int64_t n = 2; n <= 50; ++n) {
      SCOPED_TRACE(testing::Message() << n << " parcels, boundary " << static_cast<int>(boundary));
      for (Settings s : {gas(n, 0.1, boundary), gas(n, 0.3, boundary), court(n, boundary)}) {
        s.seed = n % 3 + 1;
        SceneRun run(s);
        expect_within_edges(run);
        EXPECT_GE(smallest_gap(run), 1.0);
      }
    }
  }
}

TEST(Spawn, KeepsClearOfTheBall) {
  for (const Boundary boundary : {Boundary::open, Boundary::periodic}) {
    for (const double x : {-6.4, 0.0, 6.65}) {
      Settings s = court(4000, boundary);
      s.ball_x_m = x;
      SceneRun run(s);
      const double contact = run.physics.ball.radius_m + run.physics.parcels.radius_m;
      const Vec2i centre = to_units(run.physics.world, run.ball.position_m);
      for (const Vec2i& p : run.backend->snapshot().position) {
        const Vec2i e = boundary == Boundary::periodic
                            ? separation<Boundary::periodic>(run.physics.world, centre, p)
                            : separation<Boundary::open>(run.physics.world, centre, p);
        ASSERT_GE(length(to_double(e)) * run.physics.world.unit_m, contact);
      }
      EXPECT_GE(smallest_gap(run), 1.0);
    }
  }
}

TEST(Spawn, IsReproducibleFromTheSeed) {
  Settings s = gas(1000);
  const std::uint64_t first = SceneRun(s).backend->state_hash();
  EXPECT_EQ(SceneRun(s, 3).backend->state_hash(), first);
  s.seed = 2;
  EXPECT_NE(SceneRun(s).backend->state_hash(), first);
}

TEST(Spawn, FillsAHexagonalBox) {
  Settings s = gas(870, 0.69, Boundary::periodic);
  s.width_m = 29.0;
  s.height_m = 30.0 * std::sqrt(3.0) / 2.0;
  SceneRun run(s);
  EXPECT_GE(smallest_gap(run), 1.0);
}

// Each parcel is displaced from its site to a position that is uniform over a disc. The square of the
// displacement is uniform from 0 to the square of the radius: its mean is 1/2 with a standard error of 0.289
// / sqrt(N). The direction is uniform too: the mean displacement has an error of 0.5 / sqrt(N) along x and y.
// The test allows five errors.
TEST(Spawn, MovesUniformlyAwayFromLatticeSites) {
  const SceneRun run(gas(10000, 0.2, Boundary::open));
  const Spawner spawner(run.settings, run.physics, run.ball);
  const SpawnPlan& plan = spawner.plan();
  const std::uint64_t num_sites = plan.row_start[plan.num_rows];
  double square = 0.0;
  Vec2d mean;
  for (std::uint32_t id = 0; id < plan.num_parcels; ++id) {
    const std::uint64_t site = num_sites * id / plan.num_parcels;
    const Vec2d at = to_metres(plan.world, spawn_parcel(plan, num_sites, id).position);
    const Vec2d displacement = (at - site_position_m(plan, site)) * (1.0 / plan.jitter_m);
    ASSERT_LE(dot(displacement, displacement), 1.0 + 1e-6) << id;
    square += dot(displacement, displacement) / plan.num_parcels;
    mean += displacement * (1.0 / plan.num_parcels);
  }
  EXPECT_NEAR(square, 0.5, 5.0 * 0.289 / 100.0);
  EXPECT_NEAR(mean.x, 0.0, 5.0 * 0.5 / 100.0);
  EXPECT_NEAR(mean.y, 0.0, 5.0 * 0.5 / 100.0);
}

TEST(Spawn, RejectsTooManyParcels) {
  Settings s = gas(1000, 0.7);
  s.box_follows_parcels = false;
  s.width_m = 20.0;
  s.height_m = 20.0;
  EXPECT_THROW(SceneRun{s}, UserError);
}

}  // namespace
}  // namespace pf::test
