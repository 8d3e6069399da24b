// Undo and redo of changes of the settings.
#include "app/settings_history.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "support/scene_support.hpp"
#include "support/text.hpp"

namespace pf {
namespace {

class History : public testing::Test {
 protected:
  History() { advance({}, 0); }

  void advance(const Commands& commands, std::int64_t gesture, int cue = -1) {
    simulation_.advance_frame(commands, nullptr);
    history_.follow(simulation_.view(), simulation_.num_fallbacks(), gesture, cue);
  }
  void edit(const std::function<void(Settings&)>& change, std::int64_t gesture) {
    Commands commands;
    commands.settings = now();
    change(*commands.settings);
    advance(commands, gesture);
  }
  std::string undo() {
    Commands commands;
    const std::string line = history_.undo(commands, simulation_.view());
    advance(commands, ++key_);
    return line;
  }
  std::string redo() {
    Commands commands;
    const std::string line = history_.redo(commands, simulation_.view());
    advance(commands, ++key_);
    return line;
  }
  const Settings& now() { return simulation_.settings(); }
  void jump(double to_s) {
    Commands commands;
    commands.seek_s = to_s - simulation_.view().simulated_s + simulation_.view().flight_record->time_s();
    advance(commands, ++key_);
    for (int picture = 0; picture < 50 && simulation_.view().sought_s; ++picture) advance({}, key_);
    ASSERT_FALSE(simulation_.view().sought_s);
  }

  Simulation simulation_{test::court(300), make_cpu_backend(1)};
  SettingsHistory history_;
  std::int64_t key_ = 1000;
};

TEST_F(History, SeveralLevelsBackAndForth) {
  const Settings start = now();
  edit([](Settings& s) { s.restitution = 0.5; }, 1);
  edit([](Settings& s) { s.friction = 0.1; }, 2);
  const Settings end = now();
  EXPECT_EQ(undo(), "Undone: ball.friction is 0.3");
  EXPECT_EQ(undo(), "Undone: air.restitution is 0.9");
  EXPECT_EQ(now(), start);
  EXPECT_EQ(undo(), "Nothing to undo");
  EXPECT_EQ(redo(), "Redone: air.restitution is 0.5");
  EXPECT_EQ(redo(), "Redone: ball.friction is 0.1");
  EXPECT_EQ(now(), end);
  EXPECT_EQ(redo(), "Nothing to redo");
}

TEST_F(History, ADragIsOneChange) {
  const Settings start = now();
  for (const double value : {0.8, 0.7, 0.6}) edit([&](Settings& s) { s.restitution = value; }, 1);
  EXPECT_EQ(history_.num_undoable(), 1U);
  undo();
  EXPECT_EQ(now(), start);
  redo();
  EXPECT_EQ(now().restitution, 0.6);
}

TEST_F(History, ADragThatEndsWhereItBeganIsNone) {
  edit([](Settings& s) { s.restitution = 0.8; }, 1);
  edit([](Settings& s) { s.restitution = 0.9; }, 1);
  EXPECT_EQ(history_.num_undoable(), 0U);
}

TEST_F(History, ANewChangeEndsWhatCouldBeRedone) {
  edit([](Settings& s) { s.restitution = 0.5; }, 1);
  undo();
  edit([](Settings& s) { s.friction = 0.1; }, 2);
  EXPECT_EQ(redo(), "Nothing to redo");
  EXPECT_EQ(history_.num_undoable(), 1U);
}

TEST_F(History, KeysCount) {
  Commands commands;
  commands.time_scale_factor = 0.5;
  advance(commands, 1);
  EXPECT_EQ(undo(), "Undone: run.time_scale is 0.1");
}

TEST_F(History, NewAirIsSaid) {
  edit([](Settings& s) { s.num_parcels = 100; }, 1);
  EXPECT_EQ(undo(), "Undone: air.num_parcels is 300; the air is spawned anew");
  EXPECT_EQ(simulation_.view().num_parcels, 300U);
}

TEST_F(History, AFlightThatEndedStartsAgain) {
  for (int frame = 0; frame < 5; ++frame) advance({}, 0);
  const Settings start = now();
  Commands commands;
  commands.fly = BallLaunch{{3.0, 2.0}, 10.0};
  advance(commands, 1);
  const std::string line = undo();
  EXPECT_TRUE(contains(line, "ball.vx_mps") && contains(line, "; the flight starts again")) << line;
  EXPECT_EQ(now(), start);
  EXPECT_LT(simulation_.view().flight_record->time_s(), 0.01);
  EXPECT_NEAR(simulation_.view().ball.velocity_mps.x, 15.0, 0.5);
  commands = {};
  commands.compare = Comparison::next_method;
  advance(commands, 2);
  EXPECT_EQ(undo(), "Undone: run.method is impulse; the flight starts again");
}

TEST_F(History, ASceneComesBackWithItsCueAndItsValues) {
  const Settings start = now();
  edit([](Settings& s) { s.restitution = 0.5; }, 1);
  EXPECT_EQ(*history_.scene_settings(), start);
  Commands commands;
  commands.scene = "regulation";
  advance(commands, 2, 4);
  EXPECT_EQ(history_.scene_settings()->name, "regulation");
  EXPECT_EQ(undo(), "Undone: scene court; the flight starts again");
  EXPECT_EQ(now().restitution, 0.5);
  EXPECT_EQ(now().name, "court");
  EXPECT_EQ(*history_.scene_settings(), start);
  EXPECT_EQ(history_.take_cue(), -1);
  EXPECT_EQ(redo(), "Redone: scene regulation; the flight starts again");
  EXPECT_EQ(history_.take_cue(), 4);
  EXPECT_EQ(history_.take_cue(), std::nullopt);
}

TEST_F(History, ARefusedUndoStaysPossible) {
  edit([](Settings& s) { s.friction = 0.1; }, 1);
  Commands none;
  EXPECT_NE(history_.undo(none, simulation_.view()), "");
  advance({}, 2);  // its commands were lost
  EXPECT_EQ(history_.num_undoable(), 1U);
  EXPECT_EQ(undo(), "Undone: ball.friction is 0.3");
}

// What a jump in time brings back was changed once, by whoever changed it.
TEST_F(History, JumpsAreNoChanges) {
  simulation_.keep_checkpoints();
  for (int frame = 0; frame < 30; ++frame) advance({}, 0);
  const double before_s = simulation_.view().simulated_s;
  edit([](Settings& s) { s.restitution = 0.5; }, 1);
  for (int frame = 0; frame < 30; ++frame) advance({}, 0);
  const double latest_s = simulation_.view().simulated_s;
  jump(0.5 * before_s);
  EXPECT_EQ(now().restitution, 0.9);
  EXPECT_EQ(history_.num_undoable(), 1U);
  jump(latest_s);
  EXPECT_EQ(now().restitution, 0.5);
  EXPECT_EQ(history_.num_undoable(), 1U);
  jump(0.5 * before_s);
  edit([](Settings& s) { s.friction = 0.1; }, ++key_);
  EXPECT_EQ(history_.num_undoable(), 2U);
  EXPECT_EQ(undo(), "Undone: ball.friction is 0.3");
}

// The flight has other settings at another moment; only the one that was changed goes back.
TEST_F(History, AnUndoAtAnotherMomentTakesBackItsSettingAlone) {
  simulation_.keep_checkpoints();
  for (int frame = 0; frame < 30; ++frame) advance({}, 0);
  const double start_s = simulation_.view().simulated_s;
  edit([](Settings& s) { s.restitution = 0.5; }, 1);
  for (int frame = 0; frame < 30; ++frame) advance({}, 0);
  edit([](Settings& s) { s.friction = 0.1; }, 2);
  const double latest_s = simulation_.view().simulated_s;
  jump(0.5 * start_s);
  ASSERT_EQ(now().restitution, 0.9);
  EXPECT_EQ(undo(), "At this moment of the flight it is so: ball.friction is 0.3");
  EXPECT_EQ(now().restitution, 0.9);
  EXPECT_EQ(history_.num_undoable(), 2U);
  jump(latest_s);
  EXPECT_EQ(undo(), "Undone: ball.friction is 0.3");
  EXPECT_EQ(now().restitution, 0.5);
  EXPECT_EQ(undo(), "Undone: air.restitution is 0.9");
  EXPECT_EQ(redo(), "Redone: air.restitution is 0.5");
  EXPECT_EQ(now().friction, 0.3);
}

TEST_F(History, ARefusedChangeIsNone) {
  edit([](Settings& s) { s.restitution = 2.0; }, 1);
  EXPECT_EQ(history_.num_undoable(), 0U);
}

}  // namespace
}  // namespace pf
