// What the panel and the keys ask of the simulation: obeyed, or refused with a message and nothing changed.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "app/simulation.hpp"
#include "scene/scene_file.hpp"
#include "support/scene_support.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class SimulationCommands : public testing::Test {
 protected:
  void advance(int num_frames, const Commands& first = {}) {
    simulation_.advance_frame(first, nullptr);
    for (int k = 1; k < num_frames; ++k) simulation_.advance_frame({}, nullptr);
  }
  void edit(const std::function<void(Settings&)>& change) {
    Commands commands;
    commands.settings = simulation_.settings();
    change(*commands.settings);
    simulation_.advance_frame(commands, nullptr);
  }
  void load(const std::string& scene) {
    Commands commands;
    commands.scene = scene;
    simulation_.advance_frame(commands, nullptr);
  }
  void pause() {
    Commands commands;
    commands.toggle_pause = true;
    simulation_.advance_frame(commands, nullptr);
  }
  const FrameView& view() const { return simulation_.view(); }

  Simulation simulation_{test::court(500), make_cpu_backend(2)};
};

TEST_F(SimulationCommands, SceneReplacesEverything) {
  advance(5);
  edit([](Settings& s) { s.restitution = 0.123; });
  load("gas");
  EXPECT_EQ(view().message, "");
  EXPECT_EQ(view().num_scenes, 2);
  EXPECT_EQ(view().simulated_s, 0.0);  // shown as it starts
  EXPECT_EQ(view().totals.num_collisions, 0U);
  Settings expected = load_scene("gas");
  expected.num_parcels = expected.num_parcels_cpu;
  expected.seconds = 0.0;  // the length of this run, which has none
  EXPECT_EQ(simulation_.settings(), expected);
  EXPECT_EQ(view().num_parcels, 20000U);
  EXPECT_FALSE(view().physics->ball.present);
  advance(1);
  EXPECT_DOUBLE_EQ(view().simulated_s, 0.035);
}

TEST_F(SimulationCommands, ASceneLoadedLiveRunsAsOneLoadedAtTheStart) {
  advance(3);
  load("gas");
  advance(2);
  Settings gas = load_scene("gas");
  Simulation other(gas, make_cpu_backend(1));
  other.advance_frame({}, nullptr);
  other.advance_frame({}, nullptr);
  EXPECT_EQ(simulation_.backend().state_hash(), other.backend().state_hash());
}

TEST_F(SimulationCommands, ASceneThatCannotBeLoadedChangesNothing) {
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

TEST_F(SimulationCommands, WhatIsNoNumberIsRefused) {
  edit([](Settings& s) { s.ball_spin_radps = std::nan(""); });
  EXPECT_TRUE(contains(view().message, "panel: 'nan' is not a finite number; ball.spin_radps takes"));
  EXPECT_EQ(simulation_.settings().ball_spin_radps, 25.0);
  EXPECT_TRUE(std::isfinite(view().ball.spin_radps));
  edit([](Settings& s) { s.restitution = 0.5; });
  EXPECT_EQ(view().message, "");
  EXPECT_EQ(simulation_.settings().restitution, 0.5);
}

TEST_F(SimulationCommands, WhatDoesNotFitIsRefused) {
  advance(2);
  edit([](Settings& s) { s.num_parcels = 1; });  // one parcel would be wider than half the court
  EXPECT_TRUE(contains(view().message, "raise air.num_parcels")) << view().message;
  EXPECT_EQ(view().num_parcels, 500U);
  EXPECT_EQ(simulation_.settings().num_parcels, 500);
}

// Threads change who computes, not what: the parcels are those of before, to the last bit.
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

TEST_F(SimulationCommands, ParcelsComeBackAsManyAsTheyWere) {
  edit([](Settings& s) { s.air = Air::vacuum; });
  EXPECT_EQ(view().num_parcels, 0U);
  edit([](Settings& s) { s.air = Air::parcels; });
  EXPECT_EQ(view().num_parcels, 500U);
}

TEST_F(SimulationCommands, ResetRepeatsTheRun) {
  advance(6);
  const std::uint64_t hash = simulation_.backend().state_hash();
  Commands reset;
  reset.reset = true;
  advance(6, reset);
  EXPECT_EQ(simulation_.backend().state_hash(), hash);
}

}  // namespace
}  // namespace pf
