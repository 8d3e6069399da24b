// Comparison of flights: their distance, and the same launch without parcels.
#include "app/flight.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "app/checkpoints.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"
#include "support/scene_support.hpp"

namespace pf {
namespace {

// Along x at 2 m/s for `until_s`, a point each `every_s`, at height y that grows by `rise` per second.
FlightRecord straight(double y, double rise, double every_s, double until_s) {
  FlightRecord flight;
  for (double t = 0.0; t <= until_s + 1e-9; t += every_s) {
    flight.points_m.push_back(to_float(Vec2d{2.0 * t, y + rise * t}));
    flight.times_s.push_back(t);
  }
  return flight;
}

TEST(FlightDistance, ComparesEqualTimes) {
  const auto distance = distance_between(straight(0.0, 0.0, 0.1, 2.0), straight(0.5, 0.25, 0.07, 1.4));
  ASSERT_TRUE(distance);
  EXPECT_NEAR(distance->until_s, 1.4, 1e-9);
  EXPECT_NEAR(distance->at_end_m, 0.5 + 0.25 * 1.4, 1e-6);
  EXPECT_NEAR(distance->largest_m, distance->at_end_m, 1e-6);
}

TEST(FlightDistance, LargestMayPrecedeTheEnd) {
  const auto distance = distance_between(straight(0.0, 0.0, 0.1, 2.0), straight(-1.0, 1.0, 0.1, 1.0));
  ASSERT_TRUE(distance);
  EXPECT_NEAR(distance->at_end_m, 0.0, 1e-6);
  EXPECT_NEAR(distance->largest_m, 1.0, 1e-6);
}

TEST(FlightDistance, LargestMayLieAtAPointOfEither) {
  FlightRecord bent = straight(0.0, 0.0, 0.5, 1.0);
  bent.points_m[1].y = 0.25F;  // at 0.5 s
  const FlightRecord other = straight(0.0, 0.0, 1.0, 1.0);
  EXPECT_NEAR(distance_between(bent, other)->largest_m, 0.25, 1e-6);
  EXPECT_NEAR(distance_between(other, bent)->largest_m, 0.25, 1e-6);
}

TEST(FlightDistance, IsEmptyWithoutAPath) {
  EXPECT_FALSE(distance_between(straight(0.0, 0.0, 0.1, 1.0), FlightRecord{}));
}

TEST(FlightRecord, EnergyDriftNeedsAnUndisturbedEnd) {
  FlightRecord flight;
  flight.start_energy_j = 4.0;
  EXPECT_FALSE(flight.energy_drift());
  flight.end_energy_j = 3.0;
  EXPECT_DOUBLE_EQ(*flight.energy_drift(), -0.25);
  flight.disturbed = true;
  EXPECT_FALSE(flight.energy_drift());
}

// A side is off by a position unit at most, 5e-9, and the longest way is two periods away.
TEST(NearestWay, CrossesAnEdgeOfAPeriodicWorldIfThatIsShorter) {
  const World walls = make_world(10.0, 6.0, Boundary::walls);
  const World periodic = make_world(10.0, 6.0, Boundary::periodic);
  EXPECT_EQ(nearest_way(walls, {4.5, 0.0}, {-4.5, 0.0}), (Vec2d{-9.0, 0.0}));
  for (const auto& [from, to, way] : {std::tuple(Vec2d{4.5, 0.0}, Vec2d{-4.5, 0.0}, Vec2d{1.0, 0.0}),
                                      {Vec2d{0.0, -2.5}, Vec2d{0.0, 2.5}, Vec2d{0.0, -1.0}},
                                      {Vec2d{3.0, 1.0}, Vec2d{4.0, 1.0}, Vec2d{1.0, 0.0}},
                                      {Vec2d{3.0, 1.0}, Vec2d{14.0, 7.0}, Vec2d{1.0, 0.0}},
                                      {Vec2d{3.0, 1.0}, Vec2d{-26.0, 13.0}, Vec2d{1.0, 0.0}}}) {
    const Vec2d found = nearest_way(periodic, from, to);
    EXPECT_NEAR(found.x, way.x, 1e-8) << to.x;
    EXPECT_NEAR(found.y, way.y, 1e-8) << to.y;
    EXPECT_EQ(is_straight_way(from, to, found), to.x == 4.0);
  }
}

TEST(Ghost, VacuumWithoutSpinIsAStraightLine) {
  Settings s = test::court(100);
  s.ball_spin_radps = 0.0;
  const auto path = ghost_path(s, Air::vacuum);
  ASSERT_GT(path.size(), 10U);
  for (const Vec2f& point : path) EXPECT_NEAR(point.y, -1.4F, 1e-5F);
  EXPECT_NEAR(path.front().x, -6.4F, 1e-5F);
  EXPECT_GT(path.back().x, 6.7F + 0.185F);
}

// A circle of radius v / (k_M omega / m) = 15 / (0.0005 * 25 / 0.026) = 31.2 m about a point above the start.
TEST(Ghost, SpinBendsTheVacuumPathToACircle) {
  const auto path = ghost_path(test::court(100), Air::vacuum);
  for (const Vec2f& point : path) EXPECT_NEAR(std::hypot(point.x + 6.4, point.y + 1.4 - 31.2), 31.2, 1e-4);
}

// Drag slows the ball, so that the same spin has more time to bend its path.
TEST(Ghost, DragBendsMore) {
  EXPECT_GT(ghost_path(test::court(100), Air::drag).back().y,
            ghost_path(test::court(100), Air::vacuum).back().y + 0.1F);
}

TEST(Ghost, OmitsTheSettingsOwnAir) {
  Settings s = test::court(100);
  EXPECT_EQ(ghosts_of(s).size(), 2U);
  s.air = Air::drag;
  const auto ghosts = ghosts_of(s);
  ASSERT_EQ(ghosts.size(), 1U);
  EXPECT_EQ(ghosts[0].air, Air::vacuum);
  s.ball_held = true;
  EXPECT_TRUE(ghosts_of(s).empty());
}

// Without parcels the box is that of the parcels, too.
TEST(Ghost, ReachesTheWallsOfABoxThatFollowsItsParcels) {
  Settings s = load_scene("gas");
  s.num_parcels = 2000;
  s.ball_present = true;
  s.ball_radius_m = 2.0;
  s.ball_x_m = -20.0;
  s.ball_y_m = 0.0;
  const World world = derive_physics(s).world;
  const double half_m = to_metres(world, world.half).x;
  const auto path = ghost_path(s, Air::vacuum);
  float farthest_m = 0.0F;
  for (const Vec2f& point : path) farthest_m = std::max(farthest_m, point.x);
  EXPECT_NEAR(farthest_m, half_m - 2.0, 0.02 * half_m);
}

Checkpoint checkpoint_at(double shown_s, std::size_t num_parcels) {
  Checkpoint moment;
  moment.shown_s = shown_s;
  moment.frame = std::llround(60.0 * shown_s);
  moment.backend.parcels.position.resize(num_parcels);
  return moment;
}

TEST(Checkpoints, KeepsTheFirstAndThinsOutTheRest) {
  Checkpoints checkpoints;
  for (double t = 0.0; t < 60.0; t += 0.25) {
    if (checkpoints.is_due(t, 10)) checkpoints.keep(checkpoint_at(t, 10));
  }
  EXPECT_EQ(checkpoints.size(), 16U);
  EXPECT_EQ(checkpoints.kept().front().shown_s, 0.0);
  EXPECT_EQ(checkpoints.kept().back().shown_s, 59.0);
  for (std::size_t i = 1; i < checkpoints.size(); ++i)
    EXPECT_LE(checkpoints.kept()[i].shown_s - checkpoints.kept()[i - 1].shown_s, 8.0);
}

TEST(Checkpoints, WithoutMemoryTheNextFlightHasSomeAgain) {
  Checkpoints checkpoints;
  checkpoints.keep(checkpoint_at(0.0, 10));
  checkpoints.stop();
  EXPECT_FALSE(checkpoints.is_due(50.0, 10));
  EXPECT_EQ(checkpoints.size(), 1U) << "those that it has stay";
  checkpoints.clear();
  EXPECT_TRUE(checkpoints.is_due(50.0, 10));
}

TEST(Checkpoints, FindTheNewestUntilAFrame) {
  Checkpoints checkpoints;
  for (double t : {0.0, 1.0, 2.0}) checkpoints.keep(checkpoint_at(t, 10));
  EXPECT_EQ(checkpoints.newest_until(119)->shown_s, 1.0);
  EXPECT_EQ(checkpoints.newest_until(120)->shown_s, 2.0);
  EXPECT_EQ(checkpoints.newest_until(0)->shown_s, 0.0);
  checkpoints.drop_after(60, 0);
  EXPECT_EQ(checkpoints.newest_until(500)->shown_s, 1.0);
  checkpoints.clear();
  EXPECT_EQ(checkpoints.newest_until(500), nullptr);
  Checkpoint changed = checkpoint_at(1.0, 10);
  changed.num_changes = 1;
  checkpoints.keep(changed);
  checkpoints.drop_after(60, 1);
  EXPECT_EQ(checkpoints.size(), 1U);
  checkpoints.drop_after(60, 0);
  EXPECT_EQ(checkpoints.size(), 0U);
}

TEST(Checkpoints, MemoryLimitsTheirNumber) {
  const Checkpoints checkpoints(3 * Checkpoints::bytes_of(1000) + 1);
  EXPECT_EQ(checkpoints.max_count(1000), 3U);
  EXPECT_EQ(checkpoints.max_count(4000), 0U);
  EXPECT_FALSE(checkpoints.is_due(0.0, 4000));
  // A gigabyte holds 16 checkpoints of up to 1.9 million parcels, and one of 31 million.
  EXPECT_EQ(Checkpoints().max_count(1'900'000), 16U);
  EXPECT_EQ(Checkpoints().max_count(31'000'000), 1U);
  EXPECT_EQ(Checkpoints().max_count(32'000'000), 0U);
}

TEST(Checkpoints, OneThatFitsIsTheFirst) {
  Checkpoints checkpoints(Checkpoints::bytes_of(1000) + 1);
  checkpoints.keep(checkpoint_at(0.0, 1000));
  EXPECT_FALSE(checkpoints.is_due(5.0, 1000));
  checkpoints.keep(checkpoint_at(5.0, 1000));
  ASSERT_EQ(checkpoints.size(), 1U);
  EXPECT_EQ(checkpoints.kept().front().shown_s, 0.0);
}

}  // namespace
}  // namespace pf
