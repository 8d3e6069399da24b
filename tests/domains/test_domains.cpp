// Domains give the bits of one backend without domains.
#include <gtest/gtest.h>

#include "backend/domains/slabs.hpp"
#include "domains/domain_pair.hpp"

namespace pf::test {
namespace {

class NumDomains : public Domains, public testing::WithParamInterface<unsigned> {};

TEST_P(NumDomains, GivesTheGoldenStates) {
  expect_golden_states([] { return domains(GetParam()); });
}

INSTANTIATE_TEST_SUITE_P(Domains, NumDomains, testing::Values(1U, 2U, 3U, 4U, 8U, 13U),
                         testing::PrintToStringParamName());

TEST_F(Domains, GiveTheGoldenStatesForAnyNumberOfRanks) {
  for (const auto& [num_ranks, num_domains] : {std::pair(2U, 2U), std::pair(2U, 6U), std::pair(3U, 3U)}) {
    SCOPED_TRACE(testing::Message() << num_ranks << " ranks, " << num_domains << " domains");
    ThreadRanks ranks(num_ranks);
    expect_golden_states([&, num = num_domains] { return ranks.make_backend(num); });
  }
}

TEST_F(Domains, GiveTheSameBitsWhileSettingsChange) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const unsigned num : {2U, 5U}) {
      SCOPED_TRACE(testing::Message() << "boundary " << static_cast<int>(boundary) << ", " << num);
      Settings s = busy_court(boundary);
      Pair pair(s, domains(num, 2));
      EXPECT_GT(pair.expect_same_steps(60, 2e-4).num_ball_hits, 0U);
      s.contacts = false;
      pair.apply(s);
      pair.expect_same_steps(40, 5e-3);
      s.contacts = true;
      s.method = Method::spring;
      pair.apply(s);
      pair.expect_same_steps(80, 1e-4);
      s.method = Method::impulse;
      s.neighbors = Neighbors::all_pairs;
      pair.apply(s);
      pair.expect_same_steps(20, 1e-3);
      s.neighbors = Neighbors::grid;
      s.restitution = 0.2;
      pair.apply(s);
      EXPECT_GT(pair.expect_same_steps(40, 1e-3).num_collisions, 0U);
    }
  }
}

// Eight slabs of a metre or less: a parcel crosses several in a step, and every step sorts.
TEST_F(Domains, GiveTheSameBitsOfParcelsThatCrossSeveralBordersInAStep) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    Pair pair(busy_court(boundary, 1500), domains(8));
    for (SceneRun* run : {&pair.plain, &pair.divided}) {
      ParcelSnapshot state = run->backend->snapshot();
      for (std::size_t i = 0; i < state.velocity.size(); i += 5) state.velocity[i] = {900.0F, -300.0F};
      run->backend->restore(state);
    }
    EXPECT_GT(pair.expect_same_steps(25, 4e-3).num_collisions, 0U);
  }
}

// They move by more than the height of a periodic world.
TEST_F(Domains, GiveTheSameBitsOfParcelsThatCrossAThinWorldInAStep) {
  Settings s = busy_court(Boundary::periodic, 1500);
  s.height_m = 0.8;
  s.area_fraction = 0.2;
  s.ball_present = false;
  Pair pair(s, domains(8));
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    ParcelSnapshot state = run->backend->snapshot();
    for (std::size_t i = 0; i < state.velocity.size(); i += 5) state.velocity[i] = {900.0F, -300.0F};
    run->backend->restore(state);
  }
  EXPECT_GT(pair.expect_same_steps(25, 4e-3).num_collisions, 0U);
  const Vec2i half = pair.plain.physics.world.half;
  for (const Vec2i position : pair.plain.backend->snapshot().position) {
    ASSERT_LE(std::abs(position.x), half.x);
    ASSERT_LE(std::abs(position.y), half.y);
  }
}

// Pairs with one centre, at rest or with different velocities: what each id gets does not depend on which of
// them is first in memory.
TEST_F(Domains, GiveTheSameBitsOfCoincidentParcels) {
  Pair pair(busy_court(Boundary::walls, 600), domains(2));
  ParcelSnapshot state = pair.plain.backend->snapshot();
  for (std::size_t i = 0; i < state.position.size() / 2; ++i) {
    const std::size_t other = state.position.size() - 1 - i;
    state.position[other] = state.position[i];
    if (i % 3 == 0) state.velocity[other] = state.velocity[i];
  }
  for (SceneRun* run : {&pair.plain, &pair.divided}) run->backend->restore(state);
  EXPECT_GT(pair.expect_same_steps(3, 1e-4).max_overlap_diameters, 0.99F);
}

// A periodic world so low that parcels half its height apart touch: both see the other below.
TEST_F(Domains, GiveTheSameBitsOfParcelsHalfAWorldApart) {
  Settings s = busy_court(Boundary::periodic, 60);
  s.ball_present = false;
  Pair pair(s, domains(2));
  pair.set_radius(0.3 * s.height_m / pair.plain.physics.parcels.radius_m);
  ParcelSnapshot state = pair.plain.backend->snapshot();
  const Vec2i half = pair.plain.physics.world.half;
  for (std::size_t i = 0; i < state.position.size(); i += 2) {
    state.position[i].y = 0;
    state.position[i + 1] = {state.position[i].x, -half.y};
  }
  for (SceneRun* run : {&pair.plain, &pair.divided}) run->backend->restore(state);
  EXPECT_GT(pair.expect_same_steps(3, 1e-4).max_overlap_diameters, 0.0F);
}

// All parcels and the ball around one border; the other domains are empty.
TEST_F(Domains, GiveTheSameBitsWhereMostDomainsAreEmpty) {
  Pair pair(busy_court(Boundary::walls, 400), domains(8));
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    ParcelSnapshot state = run->backend->snapshot();
    for (Vec2i& position : state.position) position = {position.x / 64, position.y};
    run->backend->restore(state);
    BallState ball = run->ball;
    ball.position_m = {0.0, 0.0};
    run->backend->set_ball(ball);
  }
  const StepTotals totals = pair.expect_same_steps(150, 2e-4);
  EXPECT_GT(totals.num_collisions, 0U);
  EXPECT_GT(totals.num_ball_hits, 0U);
}

// Rows of two parcels around the border, 1.8 diameters apart. They meet shortly before the next sort, when
// each has covered 0.42 diameters. The others have left the world: parcels are dense, and margins thin.
TEST_F(Domains, FindPartnersAcrossABorderUntilTheNextSort) {
  Settings s = busy_court(Boundary::open);
  s.ball_present = false;
  Pair pair(s, domains(2));
  pair.set_radius(2.0);
  const double diameter_m = 2.0 * pair.plain.physics.parcels.radius_m;
  const auto diameter = static_cast<std::int32_t>(diameter_m / pair.plain.physics.world.unit_m);
  ParcelSnapshot state = pair.plain.backend->snapshot();
  for (std::size_t i = 0; i < state.position.size(); ++i) {
    const bool is_left = i % 2 == 0;
    const std::int64_t y = (static_cast<std::int64_t>(i / 2) - 4) * 3 * diameter;
    state.position[i] =
        i < 16 ? Vec2i{is_left ? -1 : diameter / 10 * 18, static_cast<std::int32_t>(y)} : Vec2i{kRetired, 0};
    state.velocity[i] = {is_left ? 1.0F : -1.0F, 0.0F};
  }
  for (SceneRun* run : {&pair.plain, &pair.divided}) run->backend->restore(state);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(pair.expect_same_steps(1, 0.14 * diameter_m).num_collisions, 0U);
  const StepTotals totals = pair.expect_same_steps(1, 0.14 * diameter_m);
  EXPECT_EQ(totals.num_collisions, 8U);
  EXPECT_EQ(totals.num_sorts, 0U);
}

TEST_F(Domains, SortAgainForALargerRadius) {
  for (const Boundary boundary : {Boundary::open, Boundary::periodic}) {
    Settings s = busy_court(boundary);
    s.area_fraction = 0.01;
    s.ball_present = false;
    Pair pair(s, domains(4));
    EXPECT_EQ(pair.expect_same_steps(2, 1e-7).num_sorts, 1U);
    pair.set_radius(8.0);
    const StepTotals totals = pair.expect_same_steps(1, 1e-7);
    EXPECT_GT(totals.num_collisions, 0U);
    EXPECT_EQ(totals.num_sorts, 1U);
  }
}

TEST_F(Domains, NameTheFirstInvalidParcelAndStep) {
  Pair pair(busy_court(Boundary::walls, 400), domains(5));
  pair.expect_same_steps(5, 1e-4);
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    ParcelSnapshot state = run->backend->snapshot();
    state.velocity[300] = state.velocity[77] = {1e20F, 0.0F};
    run->backend->restore(state);
  }
  const StepTotals totals = pair.expect_same_steps(3, 1e-4);
  EXPECT_EQ(totals.num_invalid, 2U);
  EXPECT_EQ(totals.first_invalid_step, 5U);
  EXPECT_EQ(totals.first_invalid_id, 77U);
}

// A stream through the periodic edge: parcels of the last cells cross it between two sorts.
TEST(Search, FindsPartnersAcrossAPeriodicEdgeInAStream) {
  Settings s = court(444, Boundary::periodic);
  s.height_m = 2.45;
  s.area_fraction = 0.6;
  s.ball_present = false;
  s.flow_x_mps = 20.0;
  SceneRun grid(s, make_cpu_backend(1));
  s.neighbors = Neighbors::all_pairs;
  SceneRun all(s, make_cpu_backend(1));
  const double dt_s = 0.3 * 2.0 * grid.physics.parcels.radius_m / s.flow_x_mps;
  for (int k = 0; k < 100; ++k) {
    grid.advance(5, dt_s);
    all.advance(5, dt_s);
    ASSERT_EQ(grid.backend->state_hash(), all.backend->state_hash()) << k;
  }
}

TEST(Slabs, CoverTheWorldOnce) {
  for (const Boundary boundary : {Boundary::open, Boundary::periodic}) {
    for (const unsigned num : {1U, 3U, 7U, 64U}) {
      const Slabs slabs{make_world(2.0, 1.0, boundary), num};
      EXPECT_EQ(slabs.edge(0), -kHalfSide);
      EXPECT_EQ(slabs.edge(num), kHalfSide);
      for (unsigned k = 0; k < num; ++k) {
        const auto first = static_cast<std::int32_t>(slabs.edge(k));
        const auto last = static_cast<std::int32_t>(slabs.edge(k + 1) - 1);
        EXPECT_EQ(slabs.owner(first), k);
        EXPECT_EQ(slabs.owner(last), k);
        EXPECT_EQ(slabs.distance(first, slabs.span(k)), 0);
        if (k > 0) {
          EXPECT_EQ(slabs.distance(first - 10, slabs.span(k)), 10);
        }
      }
      const bool wraps = boundary == Boundary::periodic && num > 1;
      EXPECT_EQ(slabs.distance(-kHalfSide, slabs.span(num - 1)),
                wraps || num == 1 ? 0 : slabs.edge(num - 1) + kHalfSide);
    }
  }
}

}  // namespace
}  // namespace pf::test
