// A simulation that takes commands, for tests of what they do.
#pragma once

#include <gtest/gtest.h>

#include <functional>

#include "app/simulation.hpp"
#include "support/scene_support.hpp"

namespace pf {

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

}  // namespace pf
