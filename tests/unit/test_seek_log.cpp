// Logs of flights in which a person goes back and forth.
#include <gtest/gtest.h>

#include <random>

#include "app/simulation.hpp"
#include "support/logged_flight.hpp"
#include "temporary_folder.hpp"

namespace pf::test {
namespace {

// A person who drags the bar, changes settings and presses keys, in a window that cuts its frames.
Commands wild_commands(std::mt19937_64& random, const FrameView& view) {
  Commands commands;
  const auto edit = [&](auto&& change) {
    commands.settings = view.asked ? *view.asked : *view.settings;
    change(*commands.settings);
  };
  const double latest_s = view.history->time_at(view.history->latest());
  switch (random() % 60) {
    case 0:
      edit([](Settings& s) { s.restitution = s.restitution > 0.8 ? 0.7 : 0.9; });
      break;
    case 1:
      edit([](Settings& s) { s.method = s.method == Method::exact ? Method::impulse : Method::exact; });
      break;
    case 2:
      commands.back = true;
      break;
    case 3:
      commands.time_scale_factor = view.settings->time_scale > 0.05 ? 0.5 : 2.0;
      break;
    case 4:
      commands.compare = random() % 4 == 0 ? Comparison::next_method : Comparison::none;
      break;
    case 5:
      commands.launch = random() % 4 == 0;
      break;
    case 6:
      commands.reset = random() % 8 == 0;
      break;
    case 7:
      commands.hold = true;
      break;
    case 8:
    case 9:
    case 10:
      commands.seek_s = latest_s * static_cast<double>(random() % 101) / 100.0;
      commands.hold = true;
      break;
    case 11:
      if (random() % 4 == 0) edit([](Settings& s) { s.num_parcels = s.num_parcels > 500 ? 400 : 600; });
      break;
    case 12:
      edit([](Settings& s) { s.restitution = 2.0; });  // refused
      if (random() % 2 == 0) commands.seek_s = latest_s / 2.0;
      break;
    default:
      break;
  }
  return commands;
}

TEST(SeekLog, ReplaysToTheSameStates) {
  int num_seeks = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    TemporaryFolder folder;
    const auto file = folder.path() / "a.toml";
    std::mt19937_64 random(seed);
    Settings settings = court(500);
    settings.frame_budget_ms = seed % 2 == 0 ? kMinBudget_ms : 50.0;
    Simulation simulation(settings, make_cpu_backend(2));
    simulation.keep_checkpoints();
    simulation.keep_to_budget();
    InputLog log(simulation, "cpu");
    log.open(file);
    const int num_pictures = seed % 2 == 0 ? 3000 : 400;
    for (int picture = 0; picture < num_pictures || simulation.view().unfinished; ++picture) {
      const Commands commands =
          simulation.admit(picture < num_pictures ? wild_commands(random, simulation.view()) : Commands{});
      log.begin_frame(commands, simulation);
      simulation.begin_frame(commands, nullptr);
      simulation.finish_frame();
      log.end_frame(simulation);
    }
    log.close_all(simulation);
    for (const LoggedFrame& frame : read_log(file).frames) num_seeks += frame.seek_s ? 1 : 0;
    const Flown flown = fly_again(file, make_cpu_backend(1));
    EXPECT_EQ(flown.hash, simulation.backend().state_hash()) << "seed " << seed;
    EXPECT_EQ(flown.report["same"], true) << flown.summary << ", seed " << seed;
    EXPECT_GT(flown.report["checks"], 1) << "seed " << seed;
  }
  EXPECT_GT(num_seeks, 40);
}

}  // namespace
}  // namespace pf::test
