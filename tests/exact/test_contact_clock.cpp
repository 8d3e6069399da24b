// The default contact duration of the TC model: its value, and that no flight ends in an inelastic collapse.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "app/simulation.hpp"
#include "exact/exact_support.hpp"
#include "lab/flight_case.hpp"
#include "scene/scene_file.hpp"

namespace pf::test {
namespace {

double clock_of(const Settings& s) { return contact_clock_s(s, derive_physics(s)); }

Settings inelastic_gas(double area_fraction, double speed_mps) {
  Settings s = gas(1000, area_fraction);
  s.contact_clock = Settings{}.contact_clock;
  s.restitution = 0.5;
  s.parcel_speed_mps = speed_mps;
  return s;
}

TEST(DefaultContactClock, IsAShareOfTheMeanFreeTimeOfAGas) {
  for (const double area_fraction : {0.01, 0.2, 0.6}) {
    for (const double speed_mps : {0.1, 1.0, 30.0}) {
      const Settings s = inelastic_gas(area_fraction, speed_mps);
      const double rate_per_s = theory::collision_rate_per_s(area_fraction, speed_mps, 0.5);
      EXPECT_NEAR(clock_of(s) * rate_per_s, s.contact_clock, 0.02 * s.contact_clock);  // of Henderson's value
    }
  }
}

// A ball counts as parcels of a tenth of its speed: its layer is a small part of the air. What that changes
// of its path and drag, `lab contact-clock` tells.
TEST(DefaultContactClock, FollowsTheFasterOfParcelsAndBall) {
  Settings s = court(20000);
  s.ball_spin_radps = 0.0;
  s.parcel_speed_mps = 1.0;
  s.ball_vx_mps = 15.0;
  const double at_15_mps = clock_of(s);
  s.ball_vx_mps = 300.0;
  EXPECT_NEAR(at_15_mps / clock_of(s), 20.0, 1e-9);
  s.parcel_speed_mps = 60.0;
  EXPECT_NEAR(at_15_mps / clock_of(s), 40.0, 1e-9);
  s.ball_vx_mps = 590.0;
  EXPECT_NEAR(at_15_mps / clock_of(s), 40.0, 1e-9);
  s.parcel_speed_mps = s.ball_vx_mps = 0.0;  // nothing moves
  EXPECT_TRUE(std::isfinite(clock_of(s)));
}

TEST(DefaultContactClock, CanBeSetAndTurnedOff) {
  Settings s = court(20000);
  EXPECT_GT(clock_of(s), 0.0);
  s.restitution = 1.0;
  EXPECT_EQ(clock_of(s), 0.0) << "nothing is lost";
  s.restitution = 0.9;
  const double shared = clock_of(s);
  s.contact_clock *= 2.0;
  EXPECT_EQ(clock_of(s), 2.0 * shared);
  s.contact_clock = 0.0;
  EXPECT_EQ(clock_of(s), 0.0);
  s.contact_clock_s = 0.25;
  EXPECT_EQ(clock_of(s), 0.25);
  s.contact_clock_s = 0.0;
  s.contact_clock = 1e-3;
  s.air = Air::vacuum;
  EXPECT_EQ(clock_of(s), 0.0);
}

// Windows, steps, threads and requests are no part of it.
TEST(DefaultContactClock, DependsOnTheSceneAlone) {
  Settings s = court(20000);
  const double before = clock_of(s);
  s.dt_s = 1e-4;
  s.substeps = 3;
  s.time_scale = 0.5;
  s.threads = 3;
  s.neighbors = Neighbors::all_pairs;
  EXPECT_EQ(clock_of(s), before);
  EXPECT_EQ(step_request(s, derive_physics(s), 1, 1e-3).contact_clock_s, before);
  EXPECT_EQ(step_request(s, derive_physics(s), 7, 1e-5).contact_clock_s, before);
}

// A request that cannot be resolved in order ends a flight, and so does time that stops. max_collisions: mean
// per parcel and frame.
void expect_flight(const Settings& s, double max_time_s, double max_collisions) {
  const FlightFrames flight = fly_frames(s, max_time_s, 60.0, *make_cpu_backend(2));
  const double per_frame = 2.0 * static_cast<double>(flight.totals.num_collisions) /
                           static_cast<double>(s.num_parcels) /
                           static_cast<double>(std::max<std::size_t>(1, flight.frame_ms.size()));
  std::printf("%s, e %g, N %lld: %zu frames, %.4f s, %.3g collisions per parcel and frame\n", s.name.c_str(),
              s.restitution, static_cast<long long>(s.num_parcels), flight.frame_ms.size(), flight.time_s,
              per_frame);
  EXPECT_FALSE(flight.refused);
  EXPECT_LT(per_frame, max_collisions);
  EXPECT_EQ(flight.totals.num_invalid, 0U);
}

class PanelRestitution : public testing::TestWithParam<int> {};

// The whole flight without restitution, else a tenth of it; all whole with PF_TEST_SCALE above 1. The elastic
// air has 0.04 collisions per parcel and frame. Without a contact duration the flight at e = 0 has 1.9.
TEST_P(PanelRestitution, FliesOverTheCourt) {
  Settings s = exact(court(20000));
  s.restitution = 0.1 * GetParam();
  expect_flight(s, GetParam() == 0 || test_scale() > 1 ? 10.0 : 0.1, 0.2);
}

INSTANTIATE_TEST_SUITE_P(DefaultContactClock, PanelRestitution, testing::Range(0, 11));

// The ends of the panel's sliders, in few parcels.
TEST(DefaultContactClock, EveryCornerOfThePanelFlies) {
  for (const double e : {0.0, 0.5}) {
    for (const double area_fraction : {0.001, 0.69}) {
      for (const double ball_mps : {0.0, 60.0}) {
        for (const double parcel_mps : {0.0, 10.0}) {
          Settings s = exact(court(1000, kWalls));
          s.restitution = e;
          s.area_fraction = area_fraction;
          s.ball_vx_mps = ball_mps;
          s.parcel_speed_mps = parcel_mps;
          expect_flight(s, 0.03 * test_scale(), 10.0);
        }
      }
    }
  }
}

// The panel's slider, while the ball flies: the contact duration appears with the first loss.
TEST(DefaultContactClock, FollowsTheRestitutionInFlight) {
  SceneRun run(exact(court(4000)), 2);
  const double dt_s = plan_frame(run.settings, run.physics, run.ball).dt_s;
  for (const double e : {1.0, 0.3, 0.0, 0.9, 1.0, 0.0}) {
    run.settings.restitution = e;
    run.physics = derive_physics(run.settings);
    run.backend->set_physics(run.physics);
    const StepReport report = run.advance(60, dt_s);
    EXPECT_EQ(report.totals.num_invalid, 0U) << e;
    EXPECT_GT(report.totals.num_collisions, 0U) << e;
  }
}

TEST(DefaultContactClock, EveryStockSceneFlies) {
  for (const SceneEntry& entry : list_scenes()) {
    Settings s = exact(load_scene(entry.name));
    s.num_parcels = resolve_num_parcels(s, "cpu");
    if (s.air != Air::parcels) continue;
    const double frame_s = s.time_scale / s.frame_rate_hz;
    expect_flight(s, test_scale() > 1 ? 10.0 : 20.0 * frame_s, 10.0);
  }
}

}  // namespace
}  // namespace pf::test
