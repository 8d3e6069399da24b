// The same launch again with another method or step: what is kept, compared, and told.
#include <gtest/gtest.h>

#include "scene/derive.hpp"
#include "unit/simulation_commands.hpp"

namespace pf {
namespace {

using ComparedFlights = SimulationCommands;

TEST_F(ComparedFlights, NextMethodRepeatsTheLaunch) {
  advance(6);
  Commands next;
  next.compare = Comparison::next_method;
  for (const Method method : {Method::spring, Method::exact, Method::impulse}) {
    advance(4, next);
    EXPECT_EQ(view().message, "");
    EXPECT_EQ(simulation_.settings().method, method);
    Settings same = test::court(500);
    same.method = method;
    Simulation other(same, make_cpu_backend(1));
    for (int k = 0; k < 4; ++k) other.advance_frame({}, nullptr);
    EXPECT_EQ(simulation_.backend().state_hash(), other.backend().state_hash()) << static_cast<int>(method);
  }
  // The first flight stays beside its equal, and flights keep their numbers.
  ASSERT_EQ(view().old_flights->size(), 3U);
  EXPECT_EQ(view().flight_record->number, 4);
  EXPECT_EQ(view().old_flights->front().number, 3);
  EXPECT_EQ(view().old_flights->back().number, 1);
  for (const FlightRecord& old : *view().old_flights) {
    EXPECT_EQ(old.launch, view().flight_record->launch);
    EXPECT_TRUE(old.energy_drift());
    EXPECT_GT(old.compute_ms, 0.0);
  }
}

TEST_F(ComparedFlights, AnotherVelocityIsAnotherLaunch) {
  advance(3);
  const std::int64_t launch = view().flight_record->launch;
  edit([](Settings& s) { s.ball_vy_mps += 3.0; });
  Commands next;
  next.compare = Comparison::next_method;
  advance(3, next);
  EXPECT_NE(view().flight_record->launch, launch);
  EXPECT_EQ(&reference_of(*view().flight_record, *view().old_flights), view().flight_record);
  const std::int64_t second = view().flight_record->launch;
  advance(3, next);
  EXPECT_EQ(view().flight_record->launch, second);
}

TEST_F(ComparedFlights, TheFirstFlightOfALaunchStays) {
  advance(3);
  Commands half;
  half.compare = Comparison::half_step;
  for (int k = 0; k < 9; ++k) advance(2, half);
  ASSERT_EQ(view().old_flights->size(), 5U);
  const FlightRecord& first = view().old_flights->back();
  EXPECT_EQ(first.number, 1);
  EXPECT_EQ(&reference_of(*view().flight_record, *view().old_flights), &first);
  EXPECT_EQ((*view().old_flights)[3].number, 6);  // the oldest of the others went
  Commands launch;
  launch.launch = true;
  advance(2, launch);
  EXPECT_EQ(view().old_flights->back().number, 6);  // another launch: it goes as the others do
  EXPECT_EQ(&reference_of(*view().flight_record, *view().old_flights), view().flight_record);
}

TEST_F(ComparedFlights, AFlightThatWasCutShortIsNoReferenceForAWholeOne) {
  advance(3);
  Commands next;
  next.compare = Comparison::next_method;
  advance(1, next);
  EXPECT_EQ(reference_of(*view().flight_record, *view().old_flights).number, 1);
  for (int k = 0; k < 5000 && view().flight == Flight::flying; ++k) advance(1);
  ASSERT_TRUE(view().flight_record->has_left);
  EXPECT_EQ(reference_of(*view().flight_record, *view().old_flights).number, 2);
  advance(1, next);
  EXPECT_EQ(view().flight_record->number, 3);
  EXPECT_EQ(reference_of(*view().flight_record, *view().old_flights).number, 2);
}

TEST_F(ComparedFlights, SceneStepComesBackAfterHalves) {
  advance(3);
  const double set_dt_s = simulation_.settings().dt_s, dt_s = view().dt_s;
  Commands half, whole;
  half.compare = Comparison::half_step;
  whole.compare = Comparison::scene_step;
  advance(2, half);
  advance(2, half);
  EXPECT_TRUE(view().half_step);
  EXPECT_TRUE(view().flight_record->half_step);
  advance(2, whole);
  EXPECT_EQ(simulation_.settings().dt_s, set_dt_s);
  EXPECT_DOUBLE_EQ(view().dt_s, dt_s);
  EXPECT_FALSE(view().half_step);
  EXPECT_FALSE(view().flight_record->half_step);
  const std::int64_t number = view().flight_record->number;
  advance(2, whole);  // nothing to go back to
  EXPECT_EQ(view().flight_record->number, number);
}

TEST_F(ComparedFlights, HalfStepRepeatsTheLaunch) {
  advance(3);
  const double dt_s = view().dt_s;
  Commands half;
  half.compare = Comparison::half_step;
  advance(2, half);
  EXPECT_DOUBLE_EQ(view().dt_s, 0.5 * dt_s);
  EXPECT_EQ(view().flight_record->set_dt_s, view().dt_s);
  ASSERT_EQ(view().old_flights->size(), 1U);
  EXPECT_EQ(view().old_flights->front().launch, view().flight_record->launch);
}

TEST_F(ComparedFlights, AHalfStepIsHalfOfTheSceneThatParcelsLeave) {
  advance(3);
  Commands half;
  half.compare = Comparison::half_step;
  advance(2, half);
  edit([](Settings& s) { s.num_parcels = 4000; });
  ASSERT_TRUE(view().half_step);
  Settings whole = simulation_.settings();
  whole.dt_s = 0.0;
  const double dt_s = plan_frame(whole, derive_physics(whole), view().ball).dt_s;
  EXPECT_NEAR(simulation_.settings().dt_s, 0.5 * dt_s, 0.05 * dt_s);  // the ball has gone on a little
  edit([](Settings& s) { s.dt_s = 1e-4; });
  EXPECT_FALSE(view().half_step);
}

TEST_F(ComparedFlights, AFlightThatHasLandedKeepsItsFigures) {
  edit([](Settings& s) { s.ball_x_m = 6.0, s.relaunch = false; });
  Commands reset;
  reset.reset = true;
  advance(1, reset);
  while (view().flight == Flight::flying) advance(1);
  ASSERT_TRUE(view().flight_record->energy_drift());
  const double drift = *view().flight_record->energy_drift();
  edit([](Settings& s) { s.restitution = 0.4; });
  edit([](Settings& s) { s.num_parcels = 700; });
  EXPECT_FALSE(view().flight_record->disturbed);
  EXPECT_EQ(view().flight_record->energy_drift(), drift);
  Commands next;
  next.compare = Comparison::next_method;
  advance(1, next);
  ASSERT_EQ(view().old_flights->size(), 1U);
  const auto different = other_differences(*view().flight_record, view().old_flights->front());
  ASSERT_EQ(different.size(), 2U);
  EXPECT_EQ(different[0]->key, "num_parcels");
  EXPECT_EQ(different[1]->key, "restitution");
}

// Compared flights stay visible: the ball is not relaunched.
TEST_F(ComparedFlights, ComparedFlightsAreNotRelaunched) {
  edit([](Settings& s) { s.ball_x_m = 6.0; });
  Commands next;
  next.compare = Comparison::next_method;
  Commands reset;
  reset.reset = true;
  advance(3, reset);
  advance(200, next);
  EXPECT_EQ(view().flight, Flight::landed);
  EXPECT_EQ(view().old_flights->size(), 1U);
  advance(200, reset);
  EXPECT_GT(view().old_flights->size(), 0U);
}

}  // namespace
}  // namespace pf
