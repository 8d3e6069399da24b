// The shipped scenes: all run, scenes with a ball also without parcels, and the ball of `regulation` slows
// down as published.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "app/simulation.hpp"
#include "core/error.hpp"
#include "scene/scene_file.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

Settings scene(const std::string& name) {
  Settings s = load_scene(name);
  s.num_parcels = resolve_num_parcels(s, "cpu");
  return s;
}

TEST(Scenes, AllExist) {
  std::vector<std::string> names;
  for (const SceneEntry& entry : list_scenes()) names.push_back(entry.name);
  for (const char* name : {"blast", "bullet", "collapse", "cooling", "court", "dense", "gas", "orbit",
                           "regulation", "regulation-indoor", "seed", "shock", "tunnel"}) {
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
    EXPECT_FALSE(load_scene(name).description.empty()) << name;
    EXPECT_EQ(load_scene(name).name, name);
  }
}

TEST(Scenes, AllRunAndKeepTheirParcels) {
  for (const SceneEntry& entry : list_scenes()) {
    SceneRun run(scene(entry.name));
    const StepReport report = run.advance(5);
    EXPECT_EQ(report.totals.num_invalid, 0U) << entry.name;
    const Measures m = run.backend->measure();
    EXPECT_EQ(m.num_live + report.totals.num_retired, run.physics.parcels.num) << entry.name;
  }
}

TEST(Scenes, SeedHasTheConstantsOfItsReport) {
  const Settings s = scene("seed");
  const Physics physics = derive_physics(s);
  EXPECT_EQ(physics.parcels.mass_kg, 1e-8);
  EXPECT_EQ(physics.parcels.radius_m, 1e-8);
  EXPECT_EQ(s.restitution, 0.0);
  EXPECT_EQ(s.width_m, 13.4);
  EXPECT_EQ(s.height_m, 6.1);
  EXPECT_EQ(s.boundary, Boundary::open);
  EXPECT_EQ(s.ball_mass_kg, 0.026);
  EXPECT_EQ(s.ball_radius_m, 0.185);
  EXPECT_EQ(s.k_magnus, 0.0005);
  EXPECT_GT(s.drawn_area_fraction, 0.01) << "otherwise nothing would be visible";
}

TEST(Scenes, RejectsTooDenseGas) {
  Settings s = scene("dense");
  EXPECT_THROW(set_from_text(find_field("air.area_fraction", ""), s, "0.75", "test"), UserError);
  s.area_fraction = 0.75;
  try {
    SceneRun run(s);
    FAIL() << "spawned";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("at most 0.7 can be spawned"), std::string::npos)
        << error.what();
  }
}

// 200 steps of 4 ms, 13 collisions per parcel from the lattice. Each event rounds velocities to float, by
// 6e-8 of a random sign: 5,700 events change the energy of 870 parcels by 5e-9 of it. With `impulse` or
// `spring` and their steps for the scene the gas explodes, or loses a third of its energy.
TEST(Scenes, DenseKeepsItsEnergy) {
  SceneRun run(scene("dense"));
  const double before = run.backend->measure().parcel_energy_j;
  const StepReport report = run.advance(200);
  EXPECT_GT(report.totals.num_collisions, 870U * 6);
  EXPECT_NEAR(run.backend->measure().parcel_energy_j / before, 1.0, 5e-8);
}

// Runs the scene with that air for 40 frames, or until the ball has left. Returns the last view of its
// flight.
FrameView fly(const std::string& name, Air air) {
  Settings s = scene(name);
  s.air = air;
  Simulation simulation(s, make_cpu_backend(1));
  FrameView last = simulation.view();
  for (int frame = 0; frame < 40; ++frame) {
    simulation.advance_frame({}, nullptr);
    if (simulation.finished_flight()) break;
    last = simulation.view();
  }
  return last;
}

// Without parcels the velocity turns at a constant rate, k_magnus spin / mass, and slows down as 1/v = 1/v0 +
// k t with k = 0 or the drag constant. The length of the path is ln(1 + k v0 t) / k. Each step rounds to a
// few 1e-16; the turn may be off by 2e-16 of up to 80 rad per step. The length is summed from chords from
// frame to frame, between positions stored as floats (1e-6 m). An arc of angle a is longer than its chord by
// a^2 / 24.
TEST(Scenes, BallsFollowTheClosedFormsWithoutParcels) {
  int num_flights = 0;
  for (const SceneEntry& entry : list_scenes()) {
    const Settings s = scene(entry.name);
    if (!s.ball_present || s.ball_held) continue;
    ++num_flights;
    for (const Air air : {Air::vacuum, Air::drag}) {
      Settings without = s;
      without.air = air;
      const double k = derive_physics(without).ball.drag_per_m;
      EXPECT_EQ(k > 0.0, air == Air::drag) << entry.name;
      const FrameView view = fly(entry.name, air);
      const double t = view.simulated_s;
      ASSERT_GT(t, 0.0) << entry.name;
      EXPECT_EQ(view.num_parcels, 0U);
      const double v0 = std::hypot(s.ball_vx_mps, s.ball_vy_mps);
      const double speed = v0 / (1.0 + k * v0 * t);
      const double rate = s.k_magnus * s.ball_spin_radps / s.ball_mass_kg;
      const double heading = std::atan2(s.ball_vy_mps, s.ball_vx_mps) + rate * t;
      EXPECT_NEAR(view.ball.velocity_mps.x, speed * std::cos(heading), 1e-11 * v0) << entry.name;
      EXPECT_NEAR(view.ball.velocity_mps.y, speed * std::sin(heading), 1e-11 * v0) << entry.name;
      EXPECT_EQ(view.ball.spin_radps, s.ball_spin_radps) << "the spin is constant";
      const double length = k > 0.0 ? std::log1p(k * v0 * t) / k : v0 * t;
      const double arc = rate * view.dt_s * view.steps_per_frame;
      EXPECT_NEAR(view.ball_distance_m, length, length * arc * arc / 20.0 + 1e-4) << entry.name;
    }
  }
  EXPECT_GE(num_flights, 6);
}

TEST(Scenes, HeldBallStaysWithoutParcels) {
  for (const Air air : {Air::vacuum, Air::drag}) {
    const FrameView view = fly("tunnel", air);
    EXPECT_EQ(view.ball_distance_m, 0.0);
    EXPECT_EQ(view.totals.num_ball_hits, 0U);
  }
}

struct Regulation {
  const char* scene;
  double loss;  // share of the speed, over 13.41 m
};

void PrintTo(const Regulation& ball, std::ostream* out) { *out << ball.scene; }

class RegulationBall : public testing::TestWithParam<Regulation> {};

// Mean of ln(v0 / v) at the given distances, over flights with different seeds of the air.
std::vector<double> mean_slowing(const std::string& name, const std::vector<double>& distances_m,
                                 int flights) {
  std::vector<double> mean(distances_m.size());
  for (int k = 0; k < flights; ++k) {
    Settings s = scene(name);
    s.seed = 1001 + k;
    SceneRun run(s);
    double length_m = 0.0, last = 0.0;
    std::size_t next = 0;
    for (Vec2d at = run.ball.position_m; next < distances_m.size();) {
      const BallState ball = run.advance(1).ball;
      const Vec2d moved = ball.position_m - at;
      at = ball.position_m;
      length_m += length(moved);
      const double slowing = std::log(s.ball_vx_mps / length(ball.velocity_mps));
      if (length_m >= distances_m[next]) mean[next++] += slowing / flights;
      last = slowing;
    }
    EXPECT_GT(last, 0.0);
  }
  return mean;
}

// v(x) = v0 exp(-k x). The ball hits 250 parcels in 13.41 m, each at a random impact parameter. The loss of a
// hit is proportional to cos^2, with <cos^4> / <cos^2>^2 = 1.2: ln(v0 / v) scatters by sqrt(1.2 / hits) of
// itself. The test allows three standard errors, and 1 % for the calibration's error and for the ends of the
// court, where parcels have left: 6.2 % of k over the whole distance with 8 flights, 13 % after the first
// quarter.
TEST_P(RegulationBall, SlowsExponentiallyAsPublished) {
  const auto [name, loss] = GetParam();
  constexpr double kDistance = 13.41;
  constexpr int kFlights = 8;
  const double k = -std::log(1.0 - loss) / kDistance;
  const std::vector<double> distances = {0.25 * kDistance, 0.5 * kDistance, 0.75 * kDistance, kDistance};
  const std::vector<double> slowing = mean_slowing(name, distances, kFlights);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const double hits = 250.0 * kFlights * distances[i] / kDistance;
    const double allowed = 3.0 * std::sqrt(1.2 / hits) + 0.01;
    EXPECT_NEAR(slowing[i] / (k * distances[i]), 1.0, allowed) << distances[i] << " m";
    RecordProperty("at_" + std::to_string(i), std::to_string(slowing[i] / (k * distances[i])));
  }
}

// The closed form omits the parcels' radius (2 % of the ball's), the spin's effect on friction and the ends
// of the court: 3 % together.
TEST_P(RegulationBall, ClosedFormDragAgrees) {
  const auto [name, loss] = GetParam();
  Settings s = scene(name);
  s.air = Air::drag;
  EXPECT_NEAR(derive_physics(s).ball.drag_per_m * 13.41 / -std::log(1.0 - loss), 1.0, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Balls, RegulationBall,
                         testing::Values(Regulation{"regulation", 0.36},
                                         Regulation{"regulation-indoor", 0.46}));

// The seed's explicit Euler step, v += dt Omega x v, multiplies the speed by sqrt(1 + theta^2) per turn of
// theta. The exact rotation keeps the speed.
TEST(Scenes, OrbitKeepsItsSpeedWhereEulerSpiralsOut) {
  const Settings s = scene("orbit");
  SceneRun run(s);
  const double rate = run.physics.ball.magnus_per_rad * run.ball.spin_radps;
  const double theta = rate * s.dt_s;
  EXPECT_NEAR(theta, 0.1, 1e-15);
  constexpr int kSteps = 63;  // one turn
  Vec2d euler = run.ball.velocity_mps;
  for (int k = 0; k < kSteps; ++k) euler += perpendicular(euler) * (rate * s.dt_s);
  const BallState exact = run.advance(kSteps, s.dt_s).ball;
  // Each step rounds to a few 1e-16 of the speed.
  EXPECT_NEAR(std::hypot(euler.x, euler.y) / 5.0, std::pow(1.0 + theta * theta, 0.5 * kSteps), 1e-13);
  EXPECT_GT(std::hypot(euler.x, euler.y) / 5.0, 1.36);
  EXPECT_NEAR(std::hypot(exact.velocity_mps.x, exact.velocity_mps.y) / 5.0, 1.0, 1e-13);
  EXPECT_NEAR(std::hypot(exact.position_m.x, exact.position_m.y), 2.5, 1e-13 * kSteps)
      << "the circle's radius";
}

}  // namespace
}  // namespace pf::test
