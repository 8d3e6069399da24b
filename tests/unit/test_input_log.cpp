// The log of a run, and the same flight from it.
#include "app/input_log.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "app/replay.hpp"
#include "core/error.hpp"
#include "support/scene_support.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

constexpr int kNumFrames = 70;

// What a person does in the flight below, by frame.
Commands inputs_at(int frame, const Settings& present) {
  Commands commands;
  const auto edit = [&](const std::function<void(Settings&)>& change) {
    commands.settings = present;
    change(*commands.settings);
  };
  switch (frame) {
    case 3:
      edit([](Settings& s) { s.ball_spin_radps = -0.1; });
      break;
    case 5:
      edit([](Settings& s) { s.restitution = 1.0 / 3.0; });
      commands.launch = true;
      break;
    case 8:
      commands.toggle_pause = true;
      break;
    case 10:
      commands.single_step = true;
      break;
    case 12:
      commands.toggle_pause = true;
      break;
    case 15:
      commands.reset = true;
      break;
    case 20:
      edit([](Settings& s) { s.threads = 1; });
      break;
    case 25:
      edit([](Settings& s) { s.restitution = 2.0; });  // refused
      break;
    case 30:
      edit([](Settings& s) { s.num_parcels = 333; });
      break;
    case 40:
      commands.scene = "regulation";
      break;
    case 42:
      edit([](Settings& s) { s.num_parcels = 444; });
      break;
    default:
      break;
  }
  return commands;
}

// Flies it, with a log from `from_frame` on, and returns the last state.
std::uint64_t fly_logged(const std::filesystem::path& file, int from_frame) {
  Simulation simulation(test::court(500), make_cpu_backend(2));
  InputLog log(simulation, "cpu");
  for (int frame = 0; frame < kNumFrames; ++frame) {
    if (frame == from_frame) log.open(file);
    const Commands commands = inputs_at(frame, simulation.settings());
    log.begin_frame(commands, simulation);
    simulation.advance_frame(commands, nullptr);
    log.end_frame(simulation);
  }
  log.close_all(simulation);
  EXPECT_EQ(log.take_failure(), "");
  return simulation.backend().state_hash();
}

struct Flown {
  std::uint64_t hash = 0;
  std::string summary;
  nlohmann::json report;
};

Flown fly_again(const std::filesystem::path& file, unsigned threads) {
  const RunLog log = read_log(file);
  Simulation simulation(log.settings, make_cpu_backend(threads));
  Replay replay(log);
  while (!replay.ended()) {
    simulation.advance_frame(replay.commands(simulation.settings()), nullptr);
    replay.end_frame(simulation);
  }
  return {simulation.backend().state_hash(), replay.summary(), replay.report()};
}

TEST(InputLog, TheSameFlightAgain) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  const std::uint64_t hash = fly_logged(file, 0);
  const Flown flown = fly_again(file, 1);
  EXPECT_EQ(flown.hash, hash);
  EXPECT_EQ(flown.report["flown"], kNumFrames);
  EXPECT_EQ(flown.report["checks"], 2);  // after 60 frames and at the end
  EXPECT_EQ(flown.report["same"], true);
  EXPECT_NE(flown.summary.find("the same flight"), std::string::npos) << flown.summary;
}

// A film may begin at any time; its log has all from the start.
TEST(InputLog, BegunLaterItHoldsTheWholeFlight) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  const std::uint64_t hash = fly_logged(file, 33);
  EXPECT_EQ(fly_again(file, 2).hash, hash);
}

TEST(InputLog, OneLineChangedDivergesAtTheNextState) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  fly_logged(file, 0);
  std::string text = contents_of(file);
  const std::size_t at = text.find("air.num_parcels = 444");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 21, "air.num_parcels = 445");
  const Flown flown = fly_again(folder.write("b.toml", text), 2);
  EXPECT_EQ(flown.report["same"], false);
  EXPECT_EQ(flown.report["first_divergence"]["frame"], 59);
  EXPECT_EQ(flown.report["first_divergence"]["last_same_frame"], nullptr);
  EXPECT_NE(flown.summary.find("diverged: frame 59"), std::string::npos) << flown.summary;
}

// Without its end, as a program that was killed leaves it.
TEST(InputLog, CutShortItStillPlays) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  fly_logged(file, 0);
  std::string text = contents_of(file);
  const Flown flown = fly_again(folder.write("b.toml", text.substr(0, text.rfind("\n[[frame]]"))), 2);
  EXPECT_EQ(flown.report["flown"], 60);
  EXPECT_EQ(flown.report["same"], true);
}

TEST(InputLog, WhatIsNoLogIsRefused) {
  TemporaryFolder folder;
  const std::string head = "scene = \"x\"\nsettings = [\"air.num_parcels = 5\"]\n[[frame]]\n";
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"[scene]\nname = \"court\"\n", "is not a log of a run"},
      {"junk", "not valid TOML"},
      {head, "takes a number"},
      {head + "number = -1\n", "takes a number"},
      {head + "number = 1\npress = [\"rest\"]\n", "the nearest is reset"},
      {head + "number = 1\nset = [\"air.restitution = 3\"]\n", "is out of range"},
      {head + "number = 1\nset = [\"air.restituton = 1\"]\n", "the nearest is air.restitution"},
      {head + "number = 5\n[[frame]]\nnumber = 4\n", "in their order"},
      {head + "number = 1\nhash = 5\n", "hash takes a text"},
      {"", "cannot be read as a log"},
  };
  for (const auto& [text, reason] : wrong) {
    try {
      read_log(folder.write("a.toml", text));
      ADD_FAILURE() << "accepted: " << text;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace pf
