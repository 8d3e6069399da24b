// Jumps within a flight: they lead to the bits that the flight had, whatever lies between.
#include <gtest/gtest.h>

#include <functional>

#include "app/simulation.hpp"
#include "model/methods.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

Settings scene_of(Method method) {
  Settings s = court(method == Method::exact ? 1500 : 500);
  s.method = method;
  return s;
}

// A flight that is followed frame by frame.
struct FollowedFlight {
  explicit FollowedFlight(const Settings& settings, std::unique_ptr<Backend> backend = make_cpu_backend(2))
      : simulation(settings, std::move(backend)) {
    simulation.keep_checkpoints();
    hashes.push_back(hash());
  }

  std::uint64_t hash() { return simulation.backend().state_hash(); }
  const FrameView& view() const { return simulation.view(); }
  void edit(const std::function<void(Settings&)>& change) {
    Commands commands;
    commands.settings = simulation.settings();
    change(*commands.settings);
    fly(commands);
  }
  void fly(const Commands& commands = {}) {
    simulation.advance_frame(commands, nullptr);
    EXPECT_EQ(view().message, "");
    hashes.push_back(hash());
  }
  void fly_frames(int num) {
    for (int k = 0; k < num; ++k) fly();
  }
  // As a window does: the pictures of a frame, and while the pointer holds the flight.
  void seek(std::int64_t frame) {
    Commands commands;
    commands.seek_s = view().history->time_at(frame);
    commands.hold = true;
    simulation.advance_frame(commands, nullptr);
    commands.seek_s.reset();
    while (view().sought_s) simulation.advance_frame(commands, nullptr);
    EXPECT_EQ(view().message, "");
    EXPECT_EQ(view().history->position(), frame);
  }
  void go_on() { simulation.advance_frame({}, nullptr); }

  Simulation simulation;
  std::vector<std::uint64_t> hashes;  // after so many frames
};

class Seek : public testing::TestWithParam<Method> {
 protected:
  FollowedFlight flight{scene_of(GetParam())};
};

TEST_P(Seek, LeadsToTheStateOfThen) {
  flight.fly_frames(150);
  for (const int frame : {149, 61, 60, 59, 1, 0, 100, 150, 7}) {
    flight.seek(frame);
    EXPECT_EQ(flight.hash(), flight.hashes[static_cast<std::size_t>(frame)]) << frame;
    EXPECT_EQ(flight.view().flight_record->points_m.size(), static_cast<std::size_t>(frame) + 1);
  }
}

TEST_P(Seek, GoesOnAsItDidAndThenFurther) {
  flight.fly_frames(90);
  FollowedFlight other(scene_of(GetParam()), make_cpu_backend(1));
  other.fly_frames(100);
  flight.seek(33);
  for (std::size_t frame = 34; frame <= 100; ++frame) {
    flight.go_on();
    ASSERT_EQ(flight.hash(), other.hashes[frame]) << frame;
  }
  EXPECT_EQ(flight.view().history->latest(), 100);
  EXPECT_EQ(flight.view().totals.num_collisions, other.view().totals.num_collisions);
  EXPECT_EQ(flight.view().simulated_s, other.view().simulated_s);
}

// Changes of every kind that a flight survives. The last frame is flown under all of them.
void fly_with_changes(FollowedFlight& flight) {
  flight.fly_frames(20);
  flight.edit([](Settings& s) { s.restitution = 0.4; });
  flight.fly_frames(20);
  flight.edit([](Settings& s) { s.ball_spin_radps = -60.0; });
  flight.fly_frames(25);
  flight.edit([](Settings& s) { s.threads = 1; });
  flight.fly_frames(5);
  flight.edit([](Settings& s) { s.method = s.method == Method::exact ? Method::impulse : Method::exact; });
  flight.fly_frames(10);
  flight.edit([](Settings& s) { s.time_scale = 0.05; });
  flight.fly_frames(30);
  flight.edit([](Settings& s) { s.contacts = false; });
  flight.fly_frames(10);
}

TEST_P(Seek, RepeatsChangesOfSettingsAtTheirTimes) {
  fly_with_changes(flight);
  const auto last = static_cast<int>(flight.hashes.size()) - 1;
  for (const int frame : {100, 42, 20, 70, 71, 0, last, 64}) {
    flight.seek(frame);
    EXPECT_EQ(flight.hash(), flight.hashes[static_cast<std::size_t>(frame)]) << frame;
    EXPECT_EQ(flight.simulation.settings().restitution, frame >= 20 ? 0.4 : 0.9) << frame;
  }
  flight.seek(41);
  EXPECT_EQ(flight.view().ball.spin_radps, -60.0) << "changed at that time";
  flight.seek(64);
  for (int frame = 65; frame <= last; ++frame) {
    flight.go_on();
    ASSERT_EQ(flight.hash(), flight.hashes[static_cast<std::size_t>(frame)]) << frame;
  }
  EXPECT_FALSE(flight.simulation.settings().contacts);
  EXPECT_EQ(flight.view().history->changes().size(), 6U);
}

TEST_P(Seek, KeepsToTheBudgetInSeveralPictures) {
  Settings settings = scene_of(GetParam());
  settings.frame_budget_ms = kMinBudget_ms;
  FollowedFlight cut(settings);
  cut.simulation.keep_to_budget();
  flight.fly_frames(50);
  while (cut.view().history->position() < 50) cut.go_on();
  EXPECT_EQ(cut.hash(), flight.hashes[50]);
  Commands commands;
  commands.seek_s = cut.view().history->time_at(40);
  commands.hold = true;
  int num_pictures = 0;
  for (; num_pictures == 0 || cut.view().sought_s; ++num_pictures) {
    cut.simulation.advance_frame(commands, nullptr);
    commands.seek_s.reset();
    ASSERT_LT(num_pictures, 100000);
  }
  EXPECT_GT(num_pictures, 30);
  EXPECT_EQ(cut.hash(), flight.hashes[40]);
  // A new target while it is on its way to another one.
  for (const int frame : {30, 45, 5, 12}) {
    commands.seek_s = cut.view().history->time_at(frame);
    cut.simulation.advance_frame(commands, nullptr);
    commands.seek_s.reset();
    for (int k = 0; k < 4; ++k) cut.simulation.advance_frame(commands, nullptr);
  }
  while (cut.view().sought_s) cut.simulation.advance_frame(commands, nullptr);
  EXPECT_EQ(cut.hash(), flight.hashes[12]);
}

INSTANTIATE_TEST_SUITE_P(Methods, Seek, testing::Values(Method::impulse, Method::spring, Method::exact),
                         [](const auto& param_info) {
                           return std::string(kMethods[static_cast<std::size_t>(param_info.param)].name);
                         });

TEST(SeekInThePast, AChangeDropsWhatCameLaterAndSaysSo) {
  FollowedFlight flight(scene_of(Method::impulse));
  flight.fly_frames(80);
  flight.seek(30);
  flight.edit([](Settings& s) { s.restitution = 0.2; });
  EXPECT_NE(flight.view().notice.find("are dropped"), std::string::npos) << flight.view().notice;
  EXPECT_EQ(flight.view().history->latest(), 31);
  FollowedFlight other(scene_of(Method::impulse), make_cpu_backend(1));
  other.fly_frames(30);
  other.edit([](Settings& s) { s.restitution = 0.2; });
  EXPECT_EQ(flight.hash(), other.hash());
  EXPECT_EQ(flight.view().history->changes().size(), 1U);
}

// A moment that is kept where the settings were changed has the settings that came then.
TEST(SeekInThePast, AnotherChangeAtAKeptMomentReplacesTheFirst) {
  FollowedFlight flight(scene_of(Method::impulse));
  flight.fly_frames(60);
  flight.edit([](Settings& s) { s.restitution = 0.2; });
  flight.fly_frames(20);
  ASSERT_EQ(flight.view().kept_s.size(), 2U);
  flight.seek(59);
  flight.go_on();
  EXPECT_EQ(flight.simulation.settings().restitution, 0.9) << "the change comes with the next frame";
  flight.edit([](Settings& s) { s.restitution = 0.5; });
  const std::uint64_t hash = flight.hash();
  flight.fly_frames(3);
  flight.seek(61);
  EXPECT_EQ(flight.hash(), hash);
  EXPECT_EQ(flight.simulation.settings().restitution, 0.5);
}

TEST(SeekInThePast, ALaunchKeepsTheWholeFlight) {
  FollowedFlight flight(scene_of(Method::impulse));
  flight.fly_frames(80);
  flight.seek(30);
  Commands next;
  next.compare = Comparison::next_method;
  flight.simulation.advance_frame(next, nullptr);
  EXPECT_EQ(flight.view().message, "");
  ASSERT_EQ(flight.view().old_flights->size(), 1U);
  EXPECT_EQ(flight.view().old_flights->front().points_m.size(), 81U);
  EXPECT_TRUE(flight.view().old_flights->front().energy_drift());
  EXPECT_EQ(flight.view().history->latest(), 1);
}

// The ball has left, and the air that the next flight meets is set then.
TEST(SeekInThePast, AChangeAfterTheEndComesAgain) {
  Settings settings = scene_of(Method::impulse);
  settings.time_scale = 1.0;  // it leaves in a second
  settings.relaunch = false;
  FollowedFlight flight(settings);
  while (flight.view().flight != Flight::landed) flight.fly();
  flight.fly_frames(3);
  flight.edit([](Settings& s) { s.restitution = 0.4; });
  const std::int64_t end = flight.view().history->latest();
  flight.seek(end - 5);
  EXPECT_EQ(flight.simulation.settings().restitution, 0.9);
  for (int k = 0; k < 5; ++k) flight.go_on();
  EXPECT_EQ(flight.view().flight, Flight::landed);
  EXPECT_EQ(flight.simulation.settings().restitution, 0.4);
  EXPECT_FALSE(flight.view().history->is_past());
}

// The panel shows the settings of the moment that is passed, which an edit begins with.
TEST(SeekInThePast, AnEditOnTheWayKeepsTheOtherSettingsOfTheTarget) {
  Settings settings = scene_of(Method::impulse);
  settings.frame_budget_ms = kMinBudget_ms;
  FollowedFlight flight(settings);
  flight.simulation.keep_to_budget();
  const auto fly_to = [&](std::int64_t frame) {
    while (flight.view().history->position() < frame) flight.go_on();
  };
  fly_to(70);
  Commands commands;
  commands.settings = flight.simulation.settings();
  commands.settings->restitution = 0.4;
  flight.simulation.advance_frame(commands, nullptr);
  fly_to(90);
  commands = {};
  commands.seek_s = flight.view().history->time_at(80);
  flight.simulation.advance_frame(commands, nullptr);
  ASSERT_TRUE(flight.view().sought_s);
  ASSERT_EQ(flight.simulation.settings().restitution, 0.9) << "of a moment before the change";
  commands = {};
  commands.settings = flight.simulation.settings();
  commands.settings->friction = 0.17;
  while (flight.view().sought_s) {
    flight.simulation.advance_frame(commands, nullptr);
    commands = {};
  }
  for (int k = 0; k < 3; ++k) flight.go_on();
  EXPECT_EQ(flight.simulation.settings().friction, 0.17);
  EXPECT_EQ(flight.simulation.settings().restitution, 0.4);
}

TEST(SeekInThePast, NeedsAMoment) {
  Simulation simulation(scene_of(Method::impulse), make_cpu_backend(1));
  simulation.advance_frame({}, nullptr);
  const std::uint64_t hash = simulation.backend().state_hash();
  Commands commands;
  commands.seek_s = 0.0;
  simulation.advance_frame(commands, nullptr);
  EXPECT_NE(simulation.view().message.find("there is no checkpoint"), std::string::npos);
  commands.seek_s.reset();
  commands.hold = true;
  EXPECT_FALSE(simulation.view().sought_s);
  EXPECT_NE(simulation.backend().state_hash(), hash) << "it goes on";
}

TEST(SeekInThePast, ShowsTheProfileOfThen) {
  Settings settings = scene_of(Method::impulse);
  settings.profile = ProfileAxis::x;
  FollowedFlight flight(settings);
  ASSERT_NE(flight.view().profile, nullptr);
  const std::vector<ProfileSums> at_start = flight.view().profile->bins;
  flight.fly_frames(20);
  ASSERT_NE(flight.view().profile->bins, at_start);
  flight.seek(0);
  EXPECT_EQ(flight.view().profile->bins, at_start);
}

// The air of a flight that was launched by itself has another seed than the settings.
TEST(SeekInLaterFlights, LeadsToTheStateOfThen) {
  Settings settings = scene_of(Method::impulse);
  settings.time_scale = 1.0;  // it leaves in a second
  FollowedFlight flight(settings);
  while (flight.view().history->latest() == 0 || flight.view().flight_record->number == 1)
    flight.simulation.advance_frame({}, nullptr);
  flight.hashes = {0};
  flight.hashes.resize(static_cast<std::size_t>(flight.view().history->position()), 0);
  flight.hashes.push_back(flight.hash());
  flight.fly_frames(40);
  flight.seek(25);
  EXPECT_EQ(flight.hash(), flight.hashes[25]);
  Commands next;
  next.compare = Comparison::next_method;
  flight.simulation.advance_frame(next, nullptr);
  flight.hashes = {0, flight.hash()};
  flight.fly_frames(30);
  flight.seek(12);
  EXPECT_EQ(flight.hash(), flight.hashes[12]);
}

}  // namespace
}  // namespace pf::test
