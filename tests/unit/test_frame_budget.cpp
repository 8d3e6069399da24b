// A window's frames in several pictures: the same flights, which input ends at any picture, and logs of them.
#include <gtest/gtest.h>

#include <random>

#include "app/command_queue.hpp"
#include "model/methods.hpp"
#include "support/logged_flight.hpp"
#include "temporary_folder.hpp"

namespace pf::test {
namespace {

Settings court_with(Method method, double budget_ms) {
  Settings s = court(method == Method::exact ? 3000 : 500);
  s.method = method;
  s.frame_budget_ms = budget_ms;
  return s;
}

class CutFrames : public testing::TestWithParam<Method> {};

TEST_P(CutFrames, AreTheSame) {
  constexpr int kNumFrames = 12;
  Simulation whole(court_with(GetParam(), kMinBudget_ms), make_cpu_backend(1));
  for (int frame = 0; frame < kNumFrames; ++frame) {
    whole.advance_frame({}, nullptr);
    EXPECT_FALSE(whole.view().unfinished) << "a headless run has no budget";
  }
  Simulation cut(court_with(GetParam(), kMinBudget_ms), make_cpu_backend(2));
  cut.keep_to_budget();
  int num_pictures = 0;
  int num_slowed = 0;
  for (int frame = 0; frame < kNumFrames; ++num_pictures) {
    cut.advance_frame({}, nullptr);
    num_slowed += cut.view().num_pictures > 1 && cut.view().slow_motion < whole.view().slow_motion ? 1 : 0;
    frame += cut.view().unfinished ? 0 : 1;
  }
  EXPECT_EQ(cut.backend().state_hash(), whole.backend().state_hash());
  EXPECT_EQ(cut.view().totals.num_collisions, whole.view().totals.num_collisions);
  EXPECT_EQ(cut.view().totals.num_steps, whole.view().totals.num_steps);
  EXPECT_EQ(cut.view().simulated_s, whole.view().simulated_s);
  EXPECT_EQ(cut.view().dt_s, whole.view().dt_s);
  EXPECT_EQ(cut.view().flight_record->points_m.size(), whole.view().flight_record->points_m.size());
  EXPECT_GE(num_pictures, static_cast<int>(whole.view().totals.num_steps));
  EXPECT_GT(num_slowed, num_pictures / 2);
}

INSTANTIATE_TEST_SUITE_P(FrameBudget, CutFrames,
                         testing::Values(Method::impulse, Method::spring, Method::exact),
                         [](const auto& param_info) {
                           return std::string(kMethods[static_cast<std::size_t>(param_info.param)].name);
                         });

TEST(FrameBudget, AmpleOneCutsNothing) {
  Simulation simulation(court_with(Method::exact, 0.0), make_cpu_backend(1));
  simulation.keep_to_budget();
  for (int frame = 0; frame < 3; ++frame) {
    simulation.advance_frame({}, nullptr);
    EXPECT_FALSE(simulation.view().unfinished);
    EXPECT_EQ(simulation.view().num_pictures, 1U);
  }
}

// Pictures until the simulation is within a step.
void enter_step(Simulation& simulation) {
  for (int picture = 0; !simulation.view().mid_step; ++picture) {
    ASSERT_LT(picture, 1000);
    simulation.advance_frame({}, nullptr);
  }
}

TEST(FrameBudget, ResetDoesNotWaitForTheStep) {
  Simulation simulation(court_with(Method::exact, kMinBudget_ms), make_cpu_backend(1));
  const std::uint64_t start = simulation.backend().state_hash();
  simulation.keep_to_budget();
  enter_step(simulation);
  Commands reset;
  reset.reset = reset.toggle_pause = true;
  simulation.advance_frame(reset, nullptr);
  EXPECT_TRUE(simulation.view().paused);
  EXPECT_EQ(simulation.view().simulated_s, 0.0);
  EXPECT_EQ(simulation.backend().state_hash(), start);
}

TEST(FrameBudget, SettingsWaitForTheEndOfTheStepAndNoLonger) {
  Simulation simulation(court_with(Method::exact, kMinBudget_ms), make_cpu_backend(1));
  simulation.keep_to_budget();
  enter_step(simulation);
  const std::uint64_t steps_before = simulation.view().totals.num_steps;
  Commands edit;
  edit.settings = simulation.settings();
  edit.settings->restitution = 0.5;
  simulation.advance_frame(edit, nullptr);
  ASSERT_TRUE(simulation.view().asked) << "the panel shows what was asked for";
  EXPECT_EQ(simulation.view().asked->restitution, 0.5);
  EXPECT_EQ(simulation.settings().restitution, 0.9);
  int num_pictures = 0;
  while (simulation.settings().restitution == 0.9 && ++num_pictures < 1000)
    simulation.advance_frame({}, nullptr);
  EXPECT_EQ(simulation.settings().restitution, 0.5);
  EXPECT_FALSE(simulation.view().asked);
  EXPECT_LE(simulation.view().totals.num_steps, steps_before + 2)
      << "the step, and one with the new settings";
}

TEST(JoinedCommands, KeepBothAndOfTwoValuesTheLater) {
  Commands earlier, later;
  earlier.scene = "gas";
  earlier.toggle_pause = later.toggle_pause = true;
  earlier.launch = true;
  earlier.seek_s = 1.0;
  earlier.hold = true;
  earlier.time_scale_factor = later.time_scale_factor = 0.5;
  later.seek_s = 2.0;
  later.compare = Comparison::next_method;
  later.next_method = Method::spring;
  later.drop_future = true;
  const Commands both = joined(earlier, later);
  EXPECT_EQ(both.scene, "gas");
  EXPECT_FALSE(both.toggle_pause) << "twice is not at all";
  EXPECT_TRUE(both.launch);
  EXPECT_EQ(both.seek_s, 2.0);
  EXPECT_FALSE(both.hold) << "of the current picture alone";
  EXPECT_EQ(both.time_scale_factor, 0.25);
  EXPECT_EQ(both.compare, Comparison::next_method);
  EXPECT_EQ(both.next_method, Method::spring);
  EXPECT_TRUE(both.drop_future);
}

// Inputs of every kind at random pictures. Fewer than those of a frame apart, so that many frames are ended.
Commands random_commands(std::mt19937_64& random, const FrameView& view) {
  Commands commands;
  const auto edit = [&](auto&& change) {
    commands.settings = view.asked ? *view.asked : *view.settings;
    change(*commands.settings);
  };
  switch (random() % 120) {
    case 0:
      edit([](Settings& s) { s.restitution = s.restitution > 0.8 ? 0.7 : 0.9; });
      break;
    case 1:
      edit([](Settings& s) { s.ball_spin_radps += 3.0; });
      break;
    case 2:
      commands.toggle_pause = true;
      break;
    case 3:
      commands.single_step = view.paused;
      break;
    case 4:
      commands.reset = random() % 3 == 0;
      break;
    case 5:
      commands.launch = true;
      break;
    case 6:
      commands.fly = BallLaunch{{12.0, 1.0 / 3.0}, -20.0};
      break;
    case 7:
      commands.time_scale_factor = view.settings->time_scale > 0.05 ? 0.5 : 2.0;
      break;
    case 8:
      edit([](Settings& s) { s.method = s.method == Method::exact ? Method::impulse : Method::exact; });
      break;
    case 9:
      edit([](Settings& s) { s.num_parcels = s.num_parcels > 1000 ? 800 : 1200; });
      break;
    case 10:
      commands.back = true;
      break;
    case 11:
      commands.compare = Comparison::half_step;
      break;
    case 12:
      commands.hold = true;
      break;
    default:
      break;
  }
  return commands;
}

TEST(FrameBudget, LogsOfCutFlightsReplay) {
  int num_ended = 0;
  int num_waited = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    TemporaryFolder folder;
    const auto file = folder.path() / "a.toml";
    std::mt19937_64 random(seed);
    Settings settings = court_with(Method::exact, kMinBudget_ms);
    settings.num_parcels = 1200;
    Simulation simulation(settings, make_cpu_backend(2));
    simulation.keep_checkpoints();
    simulation.keep_to_budget();
    InputLog log(simulation, "cpu");
    log.open(file);
    for (int picture = 0; picture < 2500 || simulation.view().mid_step || simulation.view().sought_s;
         ++picture) {
      const Commands commands =
          simulation.admit(picture < 2500 ? random_commands(random, simulation.view()) : Commands{});
      log.begin_frame(commands, simulation);
      simulation.begin_frame(commands, nullptr);
      simulation.finish_frame();
      log.end_frame(simulation);
      num_waited += simulation.view().waits_for_step ? 1 : 0;
    }
    log.close_all(simulation);
    const RunLog read = read_log(file);
    for (const LoggedFrame& frame : read.frames) num_ended += frame.max_steps ? 1 : 0;
    const Flown flown = fly_again(file, make_cpu_backend(1));
    EXPECT_EQ(flown.hash, simulation.backend().state_hash()) << "seed " << seed;
    EXPECT_EQ(flown.report["same"], true) << flown.summary << ", seed " << seed;
    EXPECT_GT(flown.report["checks"], 1) << "seed " << seed;
  }
  EXPECT_GT(num_ended, 50);
  EXPECT_GT(num_waited, 50);
}

}  // namespace
}  // namespace pf::test
