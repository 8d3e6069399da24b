// Commands from panel and keys: executed, or refused with a message and without any change.
#include <gtest/gtest.h>

#include <cmath>

#include "app/simulation.hpp"
#include "scene/scene_file.hpp"
#include "support/scene_support.hpp"
#include "support/text.hpp"
#include "temporary_folder.hpp"
#include "unit/simulation_commands.hpp"

namespace pf {
namespace {

TEST_F(SimulationCommands, SceneReplacesAllSettings) {
  advance(5);
  edit([](Settings& s) { s.restitution = 0.123; });
  load("gas");
  EXPECT_EQ(view().message, "");
  EXPECT_EQ(view().num_scenes, 2);
  EXPECT_EQ(view().simulated_s, 0.0);  // the initial state is shown
  EXPECT_EQ(view().totals.num_collisions, 0U);
  Settings expected = load_scene("gas");
  expected.num_parcels = expected.num_parcels_cpu;
  expected.seconds = 0.0;  // belongs to the run, not the scene
  EXPECT_EQ(simulation_.settings(), expected);
  EXPECT_EQ(view().num_parcels, 20000U);
  EXPECT_FALSE(view().physics->ball.exists);
  advance(1);
  EXPECT_DOUBLE_EQ(view().simulated_s, 0.035);
}

TEST_F(SimulationCommands, SceneLoadedLaterRunsLikeOneLoadedAtTheStart) {
  advance(3);
  load("gas");
  advance(2);
  Settings gas = load_scene("gas");
  Simulation other(gas, make_cpu_backend(1));
  other.advance_frame({}, nullptr);
  other.advance_frame({}, nullptr);
  EXPECT_EQ(simulation_.backend().state_hash(), other.backend().state_hash());
}

TEST_F(SimulationCommands, InvalidSceneChangesNothing) {
  TemporaryFolder folder;
  advance(4);
  pause();
  const Settings before = simulation_.settings();
  const std::uint64_t hash = simulation_.backend().state_hash();
  for (const char* text : {"junk", "[air]\nrestituton = 1\n", "[air]\nparcel_radius_m = 1\n"}) {
    const auto file = folder.write("bad.toml", text);
    load(file.string());
    EXPECT_FALSE(view().message.empty()) << text;
    EXPECT_FALSE(contains(view().message, "\n"));
    EXPECT_EQ(simulation_.settings(), before) << text;
    EXPECT_EQ(view().num_scenes, 1);
    EXPECT_EQ(simulation_.backend().state_hash(), hash) << text;
  }
  load("cort");
  EXPECT_TRUE(contains(view().message, "'cort' is not a scene; the nearest is court")) << view().message;
  EXPECT_GT(view().simulated_s, 0.0);
}

TEST_F(SimulationCommands, RejectsNan) {
  edit([](Settings& s) { s.ball_spin_radps = std::nan(""); });
  EXPECT_TRUE(contains(view().message, "panel: 'nan' is not a finite number; ball.spin_radps takes"));
  EXPECT_EQ(simulation_.settings().ball_spin_radps, 25.0);
  EXPECT_TRUE(std::isfinite(view().ball.spin_radps));
  edit([](Settings& s) { s.restitution = 0.5; });
  EXPECT_EQ(view().message, "");
  EXPECT_EQ(simulation_.settings().restitution, 0.5);
}

TEST_F(SimulationCommands, RejectsParcelsThatDoNotFit) {
  advance(2);
  edit([](Settings& s) { s.num_parcels = 1; });  // one parcel would be wider than half the court
  EXPECT_TRUE(contains(view().message, "raise air.num_parcels")) << view().message;
  EXPECT_EQ(view().num_parcels, 500U);
  EXPECT_EQ(simulation_.settings().num_parcels, 500);
}

TEST_F(SimulationCommands, RejectsARadiusThatDoesNotFit) {
  advance(2);
  edit([](Settings& s) { s.parcel_radius_m = 2.0; });
  EXPECT_TRUE(contains(view().message, "air: 500 parcels are 4 m wide")) << view().message;
  Settings crowded = simulation_.settings();  // a third of the court for the ball, and two thirds for parcels
  crowded.ball_radius_m = 2.9;
  crowded.ball_x_m = crowded.ball_y_m = 0.0;
  crowded.parcel_radius_m = 0.185;
  std::string message;
  try {
    Simulation(crowded, make_cpu_backend(1));
  } catch (const UserError& error) {
    message = error.what();
  }
  EXPECT_TRUE(contains(message, "air.parcel_radius_m: 500 parcels of diameter 0.37 m")) << message;
  EXPECT_TRUE(contains(message, "lower air.parcel_radius_m or air.num_parcels")) << message;
}

// Where time step and steps per frame are set, the keys change the steps per frame, and say where that ends.
TEST_F(SimulationCommands, KeysOfThePaceSetStepsPerFrameWhereTheseSetThePace) {
  load("regulation");
  edit([](Settings& s) { s.num_parcels = 500; });
  advance(1);
  Commands slower, faster;
  slower.time_scale_factor = 0.5;
  faster.time_scale_factor = 2.0;
  const double pace = view().slow_motion;
  for (const std::int64_t expected : {4, 2, 1}) {
    simulation_.advance_frame(slower, nullptr);
    EXPECT_EQ(simulation_.settings().substeps, expected);
    EXPECT_DOUBLE_EQ(view().slow_motion, pace * static_cast<double>(expected) / 8.0);
  }
  EXPECT_EQ(view().notice, "");
  simulation_.advance_frame(slower, nullptr);
  EXPECT_EQ(simulation_.settings().substeps, 1);
  EXPECT_TRUE(contains(view().notice, "One step of 0.000520833 s a frame is the slowest")) << view().notice;
  simulation_.advance_frame(faster, nullptr);
  EXPECT_EQ(simulation_.settings().substeps, 2);
  EXPECT_EQ(view().notice, "");
  EXPECT_EQ(simulation_.settings().time_scale, 0.25);
  EXPECT_FALSE(view().flight_record->disturbed) << "the steps are the same";
}

// Where a frame has as many steps as it may, slower is slower than what is seen.
TEST_F(SimulationCommands, KeysOfThePaceSlowAFlightThatIsSlowerThanAsked) {
  edit([](Settings& s) {
    s.time_scale = 10.0;
    s.max_substeps = 2;
  });
  advance(1);
  const double pace = view().slow_motion;
  ASSERT_LT(pace, 1.0);
  Commands slower;
  slower.time_scale_factor = 0.5;
  simulation_.advance_frame(slower, nullptr);
  EXPECT_DOUBLE_EQ(simulation_.settings().time_scale, 0.5 * pace);
}

// A change of threads keeps the parcels bit for bit.
TEST_F(SimulationCommands, ThreadsKeepTheParcels) {
  advance(20);
  pause();
  const std::uint64_t hash = simulation_.backend().state_hash();
  edit([](Settings& s) { s.threads = 1; });
  EXPECT_EQ(view().message, "");
  EXPECT_TRUE(simulation_.backend().device().ends_with(", 1 thread")) << simulation_.backend().device();
  EXPECT_EQ(simulation_.backend().state_hash(), hash);
  edit([](Settings& s) { s.threads = 3; });
  EXPECT_TRUE(simulation_.backend().device().ends_with(", 3 threads"));
  EXPECT_EQ(simulation_.backend().state_hash(), hash);
}

TEST_F(SimulationCommands, NumberOfParcelsIsRestored) {
  edit([](Settings& s) { s.air = Air::vacuum; });
  EXPECT_EQ(view().num_parcels, 0U);
  edit([](Settings& s) { s.air = Air::parcels; });
  EXPECT_EQ(view().num_parcels, 500U);
}

TEST_F(SimulationCommands, GhostsAreOfTheFlightsLaunch) {
  advance(5);
  const auto end_of = [&] { return view().ghosts->at(0).points_m.back(); };
  const Vec2f end = end_of();
  edit([](Settings& s) { s.ball_spin_radps += 40.0; });
  EXPECT_EQ(end_of(), end) << "its spin is changed in flight";
  edit([](Settings& s) {
    s.ball_vy_mps += 3.0;
    s.ball_y_m += 1.0;
  });
  EXPECT_EQ(end_of(), end) << "the next launch is changed";
  Commands again;
  again.launch = true;
  simulation_.advance_frame(again, nullptr);
  EXPECT_NE(end_of(), end) << "the next launch has all that";
}

TEST_F(SimulationCommands, ResetRepeatsTheRun) {
  advance(6);
  const std::uint64_t hash = simulation_.backend().state_hash();
  Commands reset;
  reset.reset = true;
  advance(6, reset);
  EXPECT_EQ(simulation_.backend().state_hash(), hash);
}

// A launch by hand is stored in the settings, so that a run that starts with them is the same.
TEST_F(SimulationCommands, LaunchByHandEqualsOneBySettings) {
  advance(7);
  Commands commands;
  commands.fly = BallLaunch{{9.0, 4.0}, -30.0};
  advance(5, commands);
  EXPECT_EQ(view().message, "");
  EXPECT_EQ(simulation_.settings().ball_vx_mps, 9.0);
  EXPECT_EQ(simulation_.settings().ball_spin_radps, -30.0);
  Settings same = test::court(500);
  same.ball_vx_mps = 9.0;
  same.ball_vy_mps = 4.0;
  same.ball_spin_radps = -30.0;
  Simulation other(same, make_cpu_backend(1));
  for (int k = 0; k < 5; ++k) other.advance_frame({}, nullptr);
  EXPECT_EQ(simulation_.backend().state_hash(), other.backend().state_hash());
  ASSERT_EQ(view().old_flights->size(), 1U);  // the previous one is kept
  EXPECT_EQ(length(view().old_flights->front().launch_mps), 15.0);
}

TEST_F(SimulationCommands, RejectsALaunchThatIsTooFast) {
  Commands commands;
  commands.fly = BallLaunch{{1e9, 0.0}, 0.0};
  advance(1, commands);
  EXPECT_TRUE(contains(view().message, "ball.vx_mps")) << view().message;
  EXPECT_EQ(simulation_.settings().ball_vx_mps, 15.0);
}

TEST_F(SimulationCommands, FlightByHandIsNotRelaunched) {
  Commands fly;
  fly.fly = BallLaunch{{-15.0, 0.0}, 0.0};  // out over the near edge
  advance(200, fly);
  EXPECT_EQ(view().flight, Flight::landed);
  EXPECT_TRUE(view().waits);
  EXPECT_TRUE(view().flight_record->energy_drift());
  Commands launch;
  launch.launch = true;
  advance(1, launch);
  EXPECT_FALSE(view().waits);
}

TEST_F(SimulationCommands, BackRestoresTheState) {
  simulation_.keep_checkpoints();
  std::vector<std::uint64_t> hashes = {simulation_.backend().state_hash()};
  for (int frame = 0; frame < 160; ++frame) {
    advance(1);
    hashes.push_back(simulation_.backend().state_hash());
  }
  Commands back;
  back.back = true;
  back.hold = true;
  simulation_.advance_frame(back, nullptr);
  EXPECT_EQ(view().message, "");
  EXPECT_EQ(simulation_.backend().state_hash(), hashes[100]);  // a second of 60 frames
  EXPECT_EQ(view().flight_record->points_m.size(), 101U);
  advance(60);
  EXPECT_EQ(simulation_.backend().state_hash(), hashes[160]);  // and continues identically
  simulation_.advance_frame(back, nullptr);
  simulation_.advance_frame(back, nullptr);
  EXPECT_EQ(simulation_.backend().state_hash(), hashes[40]);
}

TEST_F(SimulationCommands, BackNeedsACheckpoint) {
  Commands back;
  back.back = true;
  advance(3);
  simulation_.advance_frame(back, nullptr);
  EXPECT_TRUE(contains(view().message, "there is no checkpoint yet")) << view().message;
}

TEST_F(SimulationCommands, KeysScaleTimeDownToAThousandth) {
  Commands slower;
  slower.time_scale_factor = 0.5;
  simulation_.advance_frame(slower, nullptr);
  EXPECT_DOUBLE_EQ(simulation_.settings().time_scale, 0.05);
  for (int k = 0; k < 20; ++k) simulation_.advance_frame(slower, nullptr);
  EXPECT_DOUBLE_EQ(simulation_.settings().time_scale, 0.001);
  Commands faster;
  faster.time_scale_factor = 2.0;
  for (int k = 0; k < 20; ++k) simulation_.advance_frame(faster, nullptr);
  EXPECT_DOUBLE_EQ(simulation_.settings().time_scale, 100.0);
}

TEST_F(SimulationCommands, HoldTakesNoStep) {
  advance(3);
  const std::uint64_t hash = simulation_.backend().state_hash();
  Commands hold;
  hold.hold = true;
  simulation_.advance_frame(hold, nullptr);
  EXPECT_EQ(simulation_.backend().state_hash(), hash);
  EXPECT_FALSE(view().paused);
}

TEST_F(SimulationCommands, SavedSettingsReloadUnchanged) {
  TemporaryFolder folder;
  edit([](Settings& s) { s.restitution = 0.123; });
  Commands save;
  save.save_scene = (folder.path() / "mine").string();
  simulation_.advance_frame(save, nullptr);
  EXPECT_TRUE(contains(view().notice, "mine.toml")) << view().notice;
  Settings expected = simulation_.settings();
  expected.name = "mine";
  EXPECT_EQ(load_scene_file(folder.path() / "mine.toml"), expected);
  const std::string text = contents_of(folder.path() / "mine.toml");
  edit([](Settings& s) { s.restitution = 0.5; });
  simulation_.advance_frame(save, nullptr);
  EXPECT_TRUE(contains(view().message, "already exists")) << view().message;
  EXPECT_EQ(contents_of(folder.path() / "mine.toml"), text);
}

}  // namespace
}  // namespace pf
