// A logged flight with one input of every kind, and its replay.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "app/input_log.hpp"
#include "app/replay.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

inline constexpr int kNumFrames = 70;

// Inputs of the flight below, by frame.
inline Commands inputs_at(int frame, const Settings& present) {
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
    case 62:
      commands.scene = "regulation";
      break;
    case 64:
      edit([](Settings& s) { s.num_parcels = 444; });
      break;
    default:
      break;
  }
  return commands;
}

// Runs the flight with a log from `from_frame` on, and returns the last state.
inline std::uint64_t fly_logged(const std::filesystem::path& file, int from_frame,
                                std::unique_ptr<Backend> backend) {
  Simulation simulation(court(500), std::move(backend));
  InputLog log(simulation, simulation.backend().name());
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

inline Flown fly_again(const std::filesystem::path& file, std::unique_ptr<Backend> backend) {
  const RunLog log = read_log(file);
  Simulation simulation(log.settings, std::move(backend));
  simulation.keep_checkpoints();
  Replay replay(log);
  while (!replay.ended()) {
    simulation.advance_frame(replay.commands(simulation.settings()), nullptr);
    replay.end_frame(simulation);
  }
  return {simulation.backend().state_hash(), replay.summary(), replay.report()};
}

}  // namespace pf::test
