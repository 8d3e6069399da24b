// The reference, one law at a time: collisions, conservation, boundaries, contact duration, frozen ball.
#include <gtest/gtest.h>

#include <set>

#include "core/error.hpp"
#include "lab/lab_support.hpp"

namespace pf::test {
namespace {

using Kind = ReferenceEvent::Kind;

Physics box(double side_m, Boundary boundary, std::uint32_t num, double restitution = 1.0) {
  Physics physics;
  physics.world = make_world(side_m, side_m, boundary);
  physics.parcels = {num, 0.5, 1.0, 1.0, restitution, 1.0, true};
  physics.ball.exists = false;
  return physics;
}

// Two parcels 3 m apart collide at a given direction and speed. Time and velocities have closed forms.
// Coordinates up to 8 m have an ulp of 1e-15, and few operations round.
TEST(Reference, TwoParcelsCollideAsMechanicsSays) {
  for (const double e : {0.3, 0.9, 1.0}) {
    for (int k = 0; k < 24; ++k) {
      const double direction = 2.0 * kPi * k / 24.0 + 0.05;
      const Vec2d n{std::cos(direction), std::sin(direction)};
      const Vec2d v1 = n * 1.25 + perpendicular(n) * 0.5, v2 = n * -0.75 + perpendicular(n) * 0.5;
      Reference reference(box(16.0, Boundary::open, 2, e), {{n * -1.5, v1}, {n * 1.5, v2}}, {});
      std::vector<ReferenceEvent> events;
      reference.run_until(1.5, &events);
      ASSERT_EQ(events.size(), 1U);
      EXPECT_NEAR(events[0].time_s, (3.0 - 1.0) / 2.0, 1e-14);
      const auto after = reference.parcels();
      const Vec2d relative = after[1].velocity_mps - after[0].velocity_mps;
      EXPECT_NEAR(dot(relative, n), e * 2.0, 1e-14);
      EXPECT_NEAR(cross(n, relative), 0.0, 1e-14);
      const Vec2d momentum = after[0].velocity_mps + after[1].velocity_mps - v1 - v2;
      EXPECT_NEAR(dot(momentum, momentum), 0.0, 1e-28);
      const Vec2d apart = after[1].position_m - after[0].position_m;
      EXPECT_NEAR(length(apart), 1.0 + 0.5 * e * 2.0, 1e-14);
      EXPECT_NEAR(reference.totals().impulse_sum_mps, 0.5 * (1.0 + e) * 2.0, 1e-14);
    }
  }
}

TEST(Reference, TouchingPairsCollideAtOnceIfTheyApproach) {
  const Physics physics = box(16.0, Boundary::open, 2);
  for (const double distance : {1.0, 0.9}) {
    Reference approaching(physics, {{{0, 0}, {0.5, 0}}, {{distance, 0}, {0, 0}}}, {});
    std::vector<ReferenceEvent> events;
    approaching.run_until(1.0, &events);
    ASSERT_EQ(events.size(), 1U);
    EXPECT_EQ(events[0].time_s, 0.0);
    EXPECT_NEAR(approaching.totals().max_overlap_m, 1.0 - distance, 1e-15);
    Reference separating(physics, {{{0, 0}, {-0.5, 0}}, {{distance, 0}, {0, 0}}}, {});
    separating.run_until(1.0);
    EXPECT_EQ(separating.totals().num_collisions, 0U);
  }
}

// Coordinates are sums of powers of two, so that all four pairs collide at exactly 1 s.
TEST(Reference, OrdersSimultaneousEventsByNumber) {
  std::vector<ReferenceParcel> parcels(8);
  const int number[4][2] = {{6, 1}, {0, 7}, {5, 2}, {4, 3}};
  for (int k = 0; k < 4; ++k) {
    const double y = 4.0 * k - 6.0;
    parcels[number[k][0]] = {{-1.5, y}, {1.0, 0.0}};
    parcels[number[k][1]] = {{1.5, y}, {-1.0, 0.0}};
  }
  Reference reference(box(16.0, Boundary::periodic, 8), parcels, {});
  std::vector<ReferenceEvent> events;
  reference.run_until(1.0, &events);
  const std::vector<ReferenceEvent> expected = {
      {1.0, Kind::pair, 0, 7}, {1.0, Kind::pair, 1, 6}, {1.0, Kind::pair, 2, 5}, {1.0, Kind::pair, 3, 4}};
  EXPECT_EQ(events, expected);
}

// 6 hits 7 at 0.25 s, then 7 hits 0 at 1 s. Only 7 is predicted again, so that it alone owns the event. 1 and
// 2 collide at 1 s too.
TEST(Reference, OrdersSimultaneousEventsByNumberForAnyOwner) {
  std::vector<ReferenceParcel> parcels(8);
  for (int k = 3; k < 6; ++k) parcels[k] = {{-6.0 + 2.0 * k, 6.0}, {0.0, 0.0}};
  parcels[6] = {{-3.0, 0.0}, {4.0, 0.0}};
  parcels[7] = {{-1.0, 0.0}, {0.0, 0.0}};
  parcels[0] = {{3.0, 0.0}, {0.0, 0.0}};
  parcels[1] = {{-1.5, -4.0}, {1.0, 0.0}};
  parcels[2] = {{1.5, -4.0}, {-1.0, 0.0}};
  Reference reference(box(16.0, Boundary::open, 8), parcels, {});
  std::vector<ReferenceEvent> events;
  reference.run_until(1.0, &events);
  const std::vector<ReferenceEvent> expected = {
      {0.25, Kind::pair, 6, 7}, {1.0, Kind::pair, 0, 7}, {1.0, Kind::pair, 1, 2}};
  EXPECT_EQ(events, expected);
}

// Every collision rounds the energy by about 2^-52 of a parcel's. The sum drifts by that times the root of
// the number of collisions, relative to N parcels: 1e-13. The test allows 1e-11.
TEST(Reference, ConservesEnergyMomentumAndDistance) {
  for (const Boundary boundary : {Boundary::periodic, Boundary::walls}) {
    const SpawnedGas start(gas(500, 0.5, boundary));
    Reference reference(start.physics, start.parcels, {});
    const Measures before = reference.measure();
    reference.run_until(1e9, nullptr, 400000);
    const Measures after = reference.measure();
    EXPECT_NEAR(after.energy_j() / before.energy_j(), 1.0, 1e-11);
    if (boundary == Boundary::periodic) {
      EXPECT_NEAR(after.momentum_kg_mps.x, before.momentum_kg_mps.x, 1e-11 * before.momentum_scale_kg_mps);
      EXPECT_NEAR(after.momentum_kg_mps.y, before.momentum_kg_mps.y, 1e-11 * before.momentum_scale_kg_mps);
    } else {
      EXPECT_GT(reference.totals().num_wall_hits, 10000U);
    }
    // Coordinates up to 14 and times up to 500 have an ulp of at most 1e-13.
    EXPECT_LT(reference.totals().max_overlap_m, 1e-12);
    const Vec2d side = to_metres(start.physics.world, start.physics.world.half) * 2.0;
    const auto parcels = reference.parcels();
    double nearest2 = 1e300;
    for (std::size_t i = 0; i < parcels.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        Vec2d e = parcels[i].position_m - parcels[j].position_m;
        if (boundary == Boundary::periodic) e = {std::remainder(e.x, side.x), std::remainder(e.y, side.y)};
        nearest2 = std::min(nearest2, dot(e, e));
      }
    }
    EXPECT_GT(std::sqrt(nearest2), 1.0 - 1e-12);
  }
}

// Momentum of parcels and ball together. Smooth elastic hits also keep energy and spin; friction takes
// energy.
TEST(Reference, ConservesMomentumAndEnergyWithTheBall) {
  Physics physics = box(12.0, Boundary::periodic, 40);
  physics.ball = {true, false, 15.0, 2.0, 0.5 * 15.0 * 4.0, 0.0, 0.0, 0.0};
  const BallState ball{{0.0, 0.0}, {2.0, 1.0}, 3.0, 0.0};
  for (const double friction : {0.0, 0.3}) {
    physics.ball.friction = friction;
    Reference reference(physics, random_gas(physics, ball, 3), ball);
    const Measures before = reference.measure();
    reference.run_until(300.0);
    const Measures after = reference.measure();
    EXPECT_GT(reference.totals().num_ball_hits, 300U);
    EXPECT_NEAR(after.momentum_kg_mps.x, before.momentum_kg_mps.x, 1e-11 * before.momentum_scale_kg_mps);
    EXPECT_NEAR(after.momentum_kg_mps.y, before.momentum_kg_mps.y, 1e-11 * before.momentum_scale_kg_mps);
    if (friction == 0.0) {
      EXPECT_NEAR(after.energy_j() / before.energy_j(), 1.0, 1e-11);
      EXPECT_EQ(reference.ball().spin_radps, 3.0);
    } else {
      EXPECT_LT(after.energy_j(), before.energy_j());
      EXPECT_NE(reference.ball().spin_radps, 3.0);
    }
    EXPECT_LT(reference.totals().max_overlap_m, 1e-12);
  }
}

TEST(Reference, FrozenBallTakesItsImpulsesOnRequest) {
  Physics physics = box(12.0, Boundary::periodic, 40);
  physics.ball = {true, false, 1500.0, 2.0, 0.5 * 1500.0 * 4.0, 0.3, 0.0, 0.0};
  const BallState ball{{0.0, 0.0}, {2.0, 1.0}, 3.0, 0.0};
  Reference reference(physics, random_gas(physics, ball, 3), ball, {true, 0.0});
  const Measures before = reference.measure();
  for (int step = 1; step <= 200; ++step) {
    const BallState held = reference.ball();
    reference.run_until(0.05 * step);
    EXPECT_EQ(reference.ball().velocity_mps, held.velocity_mps);
    EXPECT_EQ(reference.ball().spin_radps, held.spin_radps);
    reference.apply_ball_impulses();
  }
  EXPECT_GT(reference.totals().num_ball_hits, 30U);
  const Measures after = reference.measure();
  EXPECT_NEAR(after.momentum_kg_mps.x, before.momentum_kg_mps.x, 1e-12 * before.momentum_scale_kg_mps);
  EXPECT_NEAR(after.momentum_kg_mps.y, before.momentum_kg_mps.y, 1e-12 * before.momentum_scale_kg_mps);
  const ReferenceTotals& totals = reference.totals();
  EXPECT_NEAR(reference.ball().velocity_mps.x - 2.0, totals.ball_impulse_kg_mps.x / 1500.0, 1e-12);
  EXPECT_NEAR(reference.ball().spin_radps - 3.0,
              totals.ball_torque_impulse_kg_m2ps / physics.ball.inertia_kg_m2, 1e-12);
}

// The second collision comes 0.13 s after the first: within the contact duration it is elastic.
TEST(Reference, ContactClockMakesQuickSuccessionElastic) {
  const std::vector<ReferenceParcel> row = {{{-2.0, 0}, {1.0, 0}}, {{0.0, 0}, {0, 0}}, {{1.1, 0}, {0, 0}}};
  for (const double clock : {0.0, 0.05, 0.2}) {
    Reference reference(box(16.0, Boundary::open, 3, 0.5), row, {}, {false, clock});
    std::vector<ReferenceEvent> events;
    reference.run_until(1.3, &events);
    ASSERT_EQ(events.size(), 2U);
    // The first hits the second with speed 1: 0.25 and 0.75. The second passes on 0.75 of its speed, or all
    // of it.
    EXPECT_NEAR(events[1].time_s, 1.0 + 0.1 / 0.75, 1e-14);
    const double passed_on = clock == 0.2 ? 0.75 : 0.75 * 0.75;
    EXPECT_NEAR(reference.parcels()[2].velocity_mps.x, passed_on, 1e-14) << clock;
  }
}

// Hits of the ball lose energy whatever the contact duration, as those of `exact`, and walls never do.
TEST(Reference, TheContactClockIsOfCollisionsOfParcels) {
  Physics physics = box(16.0, Boundary::walls, 1, 0.5);
  physics.ball = {true, true, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  const BallState ball{{5.0, 0.0}, {0.0, 0.0}, 0.0, 0.0};
  const ReferenceParcel parcel{{7.0, 0.0}, {1.0, 0.0}};
  const auto speed_after = [&](double clock_s, double time_s) {
    Reference reference(physics, {parcel}, ball, {false, clock_s});
    reference.run_until(time_s);
    return reference.parcels()[0].velocity_mps.x;
  };
  // Wall at 0.5 s, ball at 1.5 s.
  EXPECT_EQ(speed_after(0.0, 0.6), -1.0) << "walls are elastic";
  EXPECT_NEAR(speed_after(0.5, 1.6), 0.5, 1e-15) << "the contact duration of the wall is over";
  EXPECT_NEAR(speed_after(1.2, 1.6), 0.5, 1e-15) << "within that of the wall";
}

// Inelastic collapse (McNamara and Young 1994): without a contact duration a chain of parcels collides ever
// faster until time stops; with it the run continues. At e = 0.6, their case, this start has not collapsed
// after 600 collisions per parcel; at 0.4 it collapses after 50.
TEST(Reference, ContactClockPreventsInelasticCollapse) {
  for (const double restitution : {0.6, 0.4}) {
    Settings settings = gas(1024, 0.25, Boundary::periodic);
    settings.restitution = restitution;
    const SpawnedGas start(settings);
    Reference with(start.physics, start.parcels, {}, {false, 1e-3});
    EXPECT_TRUE(with.run_until(1000.0, nullptr, 400000));
    EXPECT_GT(with.totals().num_collisions, 20000U);
    EXPECT_LT(with.measure().parcel_energy_j, 0.01 * 1024.0);
    if (restitution == 0.6) continue;
    Reference without(start.physics, start.parcels, {});
    EXPECT_FALSE(without.run_until(2000.0, nullptr, 400000));
    std::vector<ReferenceEvent> events;
    without.run_until(2000.0, &events, 1000);
    ASSERT_FALSE(events.empty());
    EXPECT_LT(events.back().time_s - events.front().time_s, 1e-9) << "time has stopped";
    std::set<std::uint32_t> chain;
    for (const ReferenceEvent& event : events) chain.insert({event.a, event.b});
    EXPECT_GT(chain.size(), 2U) << "a chain of parcels, not a pair that rounding holds together";
  }
}

TEST(Reference, WallsReflectRimsAndOpenEdgesRetireCentres) {
  std::vector<ReferenceEvent> events;
  Reference walls(box(16.0, Boundary::walls, 1), {{{7.0, 0.0}, {1.0, 0.0}}}, {});
  walls.run_until(1.0, &events);
  Reference open(box(16.0, Boundary::open, 1), {{{7.0, 0.0}, {1.0, 0.0}}}, {});
  open.run_until(2.0, &events);
  const std::vector<ReferenceEvent> expected = {{0.5, Kind::wall_x, 0, 0}, {1.0, Kind::exit, 0, 0}};
  EXPECT_EQ(events, expected);
  EXPECT_EQ(walls.parcels()[0].velocity_mps.x, -1.0);
  EXPECT_TRUE(open.parcels()[0].retired);
  EXPECT_EQ(open.measure().num_live, 0U);
}

TEST(Reference, RetiredParcelsDoNotCollide) {
  Reference reference(box(16.0, Boundary::open, 2),
                      {{{0.0, 0.0}, {0.0, 0.0}, true}, {{-2.0, 0.0}, {1.0, 0.0}}}, {});
  reference.run_until(4.0);
  EXPECT_EQ(reference.totals().num_collisions, 0U);
  EXPECT_EQ(reference.parcels()[0].position_m, (Vec2d{0.0, 0.0}));
  EXPECT_EQ(reference.parcels()[1].position_m, (Vec2d{2.0, 0.0}));
}

TEST(Reference, RestartsFromItsOwnStateAndFromASnapshot) {
  const SpawnedGas start(gas(300, 0.4, Boundary::periodic));
  SceneRun run(gas(300, 0.4, Boundary::periodic), 1);
  ParcelSnapshot snapshot = run.backend->snapshot();
  snapshot.position[7] = {kRetired, 0};
  const auto parcels = reference_parcels(start.physics.world, snapshot);
  EXPECT_TRUE(parcels[7].retired);
  EXPECT_EQ(parcels[8].position_m, to_metres(start.physics.world, snapshot.position[8]));
  Reference reference(start.physics, parcels, {});
  reference.run_until(5.0);
  EXPECT_EQ(reference.measure().num_live, 299U);
  // Two halves agree with one run: the rounding of a restart grows by about 1e4 within one or two collision
  // times.
  Reference first(start.physics, start.parcels, {});
  first.run_until(0.4);
  Reference second(start.physics, first.parcels(), {});
  first.run_until(0.8);
  second.run_until(0.4);
  for (std::size_t i = 0; i < 300; ++i) {
    EXPECT_NEAR(first.parcels()[i].position_m.x, second.parcels()[i].position_m.x, 1e-9);
  }
}

TEST(Reference, RejectsUnsupportedInput) {
  const std::vector<ReferenceParcel> one = {{{0, 0}, {1, 0}}};
  EXPECT_THROW(Reference(box(16.0, Boundary::open, 1, 0.0), one, {}), UserError);
  EXPECT_THROW(Reference(box(1.9, Boundary::periodic, 1), one, {}), UserError);
  EXPECT_THROW(Reference(box(16.0, Boundary::open, 0), {}, {}), UserError);
  EXPECT_THROW(Reference(box(16.0, Boundary::open, 1), one, {}, {false, -1.0}), UserError);
  Physics scaled = box(16.0, Boundary::open, 1);
  scaled.parcels.impulse_scale = 2.0;
  EXPECT_THROW(Reference(scaled, one, {}), UserError);
}

}  // namespace
}  // namespace pf::test
