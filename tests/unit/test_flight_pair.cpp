// Two flights with one clock: each the same bits as alone, whatever the commands.
#include "app/flight_pair.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "support/flight_pair_support.hpp"

namespace pf::test {
namespace {

// One input of every kind, for a flight with these settings.
Commands inputs_at(int frame, const Settings& settings) {
  Commands commands;
  if (frame == 6) return edit(settings, [](Settings& s) { s.restitution = 0.4; });
  if (frame == 14) return edit(settings, [](Settings& s) { s.num_parcels = 400; });
  if (frame == 18) return edit(settings, [](Settings& s) { s.restitution = 7.0; });  // refused
  commands.toggle_pause = frame == 9 || frame == 12;
  commands.single_step = frame == 11;
  commands.launch = frame == 20;
  if (frame == 24) commands.time_scale_factor = 0.5;
  if (frame == 28) commands.fly = BallLaunch{{11.0, 3.0}, -40.0};
  commands.hold = frame == 32 || frame == 33;
  commands.reset = frame == 38;
  if (frame == 44) commands.scene = "orbit";
  return commands;
}

TEST(FlightPair, EachFliesToTheSameBitsAsAlone) {
  Settings settings = two_threads(court(500));
  settings.time_scale = 0.4;
  for (const char* difference : {"run.method = spring", "air.restitution = 0.3", "ball.friction = 0"}) {
    Pair both(settings, {difference});
    Simulation alone_first(settings, make_cpu_backend(1));
    Simulation alone_second(differing(settings, {difference}), make_cpu_backend(1));
    alone_first.advance_frame({}, nullptr);
    alone_second.advance_frame({}, nullptr);
    int num_different = 0;
    for (int frame = 1; frame < 50; ++frame) {
      both.picture(inputs_at(frame, both.first.settings()));
      ASSERT_TRUE(both.pair.second()) << difference << ": " << both.pair.view().message;
      const Commands commands = inputs_at(frame, alone_first.settings());
      Commands own = commands;
      if (own.settings) own.settings = differing(*own.settings, {difference});
      alone_first.advance_frame(commands, nullptr);
      num_different += hash_of(both.first) != hash_of(both.second()) ? 1 : 0;
      if (!own.scene.empty()) {
        own.restart = differing(alone_first.settings(), {difference});
        own.scene.clear();
      }
      alone_second.advance_frame(own, nullptr);
      ASSERT_EQ(hash_of(both.first), hash_of(alone_first)) << difference << ", frame " << frame;
      ASSERT_EQ(hash_of(both.second()), hash_of(alone_second)) << difference << ", frame " << frame;
    }
    EXPECT_GT(num_different, 5) << difference;
    EXPECT_EQ(both.second().settings().name, "orbit");
  }
}

// A frame of 1.6 ms has two steps of 1 ms, so that the first half is ahead now and then.
TEST(FlightPair, TheOneAheadWaitsAndStaysTheSame) {
  Settings settings = court(300);
  settings.dt_s = 1e-3;
  Pair both(settings, {"run.dt_s = 0"});
  Simulation alone_first(two_threads(settings), make_cpu_backend(1));
  Simulation alone_second(differing(two_threads(settings), {"run.dt_s = 0"}), make_cpu_backend(1));
  int num_waits = 0;
  for (int frame = 0; frame < 120; ++frame) {
    const std::pair<Simulation*, Simulation*> halves[] = {{&both.first, &alone_first},
                                                          {&both.second(), &alone_second}};
    for (const auto& [flight, alone] : halves) {
      if (alone->view().totals.num_steps == flight->view().totals.num_steps) {
        ++num_waits;
        continue;
      }
      alone->advance_frame({}, nullptr);
      ASSERT_EQ(hash_of(*flight), hash_of(*alone)) << frame;
    }
    const double apart_s = both.first.view().simulated_s - both.second().view().simulated_s;
    ASSERT_LE(std::fabs(apart_s), 2e-3) << frame;
    both.picture();
  }
  EXPECT_GT(num_waits, 5);
  EXPECT_LT(num_waits, 60);
}

// The lighter ball leaves earlier and waits for the other one, and both are launched again in the same frame.
TEST(FlightPair, BothAreLaunchedAgainTogether) {
  Settings settings = court(200);
  settings.time_scale = 1.0;
  Pair both(settings, {"ball.mass_kg = 0.006"});
  int first_landed = 0;
  int second_landed = 0;
  const std::int64_t before = both.first.view().num_flights;  // it was reset
  const auto num_launches = [&] { return both.first.view().num_flights - before + 1; };
  for (int frame = 1; frame < 600 && num_launches() < 2; ++frame) {
    if (both.first.view().flight == Flight::landed && first_landed == 0) first_landed = frame;
    if (both.second().view().flight == Flight::landed && second_landed == 0) second_landed = frame;
    ASSERT_EQ(num_launches(), both.second().view().num_flights) << frame;
    both.picture();
  }
  EXPECT_GT(first_landed, second_landed + 3);
  EXPECT_EQ(num_launches(), 2);
  EXPECT_EQ(both.second().view().num_flights, 2);
  EXPECT_TRUE(both.pair.finished_flights());
  // The next launch has other air than the first, and both the same.
  for (int frame = 0; frame < 3; ++frame) both.picture();
  EXPECT_NEAR(both.first.view().flight_record->time_s(), both.second().view().flight_record->time_s(), 1e-9);
}

struct States {
  double time_s = 0.0;
  std::uint64_t first = 0;
  std::uint64_t second = 0;
  Settings first_settings, second_settings;
};

States states_of(Pair& both) {
  return {both.first.view().simulated_s, hash_of(both.first), hash_of(both.second()), both.first.settings(),
          both.second().settings()};
}

Commands seek_to(double time_s) {
  Commands commands;
  commands.seek_s = time_s;
  return commands;
}

// Both halves go back and forth on one timeline, over changes of settings, to the bits that they had.
TEST(FlightPair, BothSeekToWhatTheyHad) {
  Pair both(court(300), {"run.method = exact"});
  both.pair.keep_checkpoints();
  Commands anew;
  anew.reset = true;
  both.picture(anew);
  std::vector<States> flown;
  for (int frame = 0; frame < 40; ++frame) {
    Commands commands;
    if (frame == 15) commands = edit(both.first.settings(), [](Settings& s) { s.restitution = 0.4; });
    if (frame == 25) commands.time_scale_factor = 0.5;
    both.picture(commands);
    flown.push_back(states_of(both));
  }
  for (const std::size_t at : {5U, 30U, 12U, 20U, 38U}) {
    both.picture(seek_to(flown[at].time_s + 1e-9));
    ASSERT_TRUE(both.pair.second()) << both.pair.view().message;
    const States now = states_of(both);
    EXPECT_DOUBLE_EQ(now.time_s, flown[at].time_s);
    EXPECT_EQ(now.first, flown[at].first) << at;
    EXPECT_EQ(now.second, flown[at].second) << at;
    EXPECT_EQ(now.first_settings, flown[at].first_settings) << at;
    EXPECT_EQ(now.second_settings, flown[at].second_settings) << at;
  }
  both.picture();
  EXPECT_EQ(states_of(both).second, flown[39].second) << "and they go on as they flew";
}

TEST(FlightPair, AnEditOnTheWayKeepsTheOtherSettingsOfTheTarget) {
  Settings settings = court(300);
  settings.frame_budget_ms = kMinBudget_ms;
  Pair both(settings, {"run.method = exact"});
  both.pair.keep_checkpoints();
  both.pair.keep_to_budget();
  Commands anew;
  anew.reset = true;
  both.picture(anew);
  const auto fly_to = [&](std::int64_t frame) {
    while (both.first.view().history->position() < frame || !both.pair.is_whole()) both.picture();
  };
  fly_to(20);
  both.picture(edit(both.first.settings(), [](Settings& s) { s.restitution = 0.4; }));
  fly_to(30);
  both.picture(seek_to(both.first.view().history->time_at(25)));
  ASSERT_TRUE(both.first.view().sought_s);
  ASSERT_EQ(both.first.settings().restitution, 0.9) << "of a moment before the change";
  both.picture(edit(both.first.settings(), [](Settings& s) { s.friction = 0.17; }));
  for (int k = 0; k < 10000 && both.first.settings().friction != 0.17; ++k) both.picture();
  EXPECT_EQ(both.first.settings().friction, 0.17);
  EXPECT_EQ(both.first.settings().restitution, 0.4);
}

// A change that only the first half has ends what the second one flew later, too.
TEST(FlightPair, AChangeInThePastDropsTheFutureOfBoth) {
  Pair both(court(300), {"air.restitution = 0.3"});
  both.pair.keep_checkpoints();
  Commands anew;
  anew.reset = true;
  both.picture(anew);
  for (int frame = 0; frame < 40; ++frame) {
    Commands commands;
    if (frame == 30) commands = edit(both.first.settings(), [](Settings& s) { s.k_magnus = 0.0; });
    both.picture(commands);
  }
  both.picture(seek_to(10.0 * both.first.view().simulated_s / 40.0));
  EXPECT_TRUE(both.second().view().history->is_past());
  both.picture(edit(both.first.settings(), [](Settings& s) { s.restitution = 0.7; }));
  EXPECT_FALSE(both.first.view().history->is_past());
  EXPECT_FALSE(both.second().view().history->is_past());
  for (int frame = 0; frame < 40; ++frame) both.picture();
  ASSERT_TRUE(both.pair.second()) << both.pair.view().message;
  EXPECT_EQ(both.second().settings(), differing(both.first.settings(), {"air.restitution = 0.3"}));
  EXPECT_EQ(both.first.settings().restitution, 0.7);
}

TEST(FlightPair, BeginsAnewAndEndsWithoutAChangeOfTheFirst) {
  Simulation first(court(300), make_cpu_backend(2));
  FlightPair pair(first, cpu);
  const auto picture = [&](const Commands& commands) {
    pair.begin(pair.admit(commands), nullptr, nullptr);
    pair.finish();
  };
  for (int frame = 0; frame < 5; ++frame) picture({});
  EXPECT_FALSE(pair.second());
  EXPECT_EQ(pair.report(), nullptr);
  picture(split_by({kNextMethod}));
  ASSERT_TRUE(pair.second());
  EXPECT_EQ(pair.difference(), Difference{"run.method = spring"});
  EXPECT_EQ(first.view().simulated_s, pair.second()->view().simulated_s);
  EXPECT_EQ(first.view().flight_record->points_m.size(), 1U);
  for (int frame = 0; frame < 3; ++frame) picture({});
  Commands next;
  next.compare = Comparison::next_method;
  picture(next);
  EXPECT_EQ(pair.difference(), Difference{"run.method = exact"});
  EXPECT_EQ(first.settings().method, Method::impulse);
  EXPECT_EQ(first.view().flight_record->points_m.size(), 1U);
  const std::uint64_t hash = hash_of(first);
  Commands pause = split_by({});
  pause.toggle_pause = true;
  picture(pause);
  EXPECT_FALSE(pair.second());
  EXPECT_EQ(hash_of(first), hash);
}

TEST(FlightPair, HalvesTheStepOfAFlightThatHasNotBegun) {
  Simulation first(two_threads(court(300)), make_cpu_backend(2));
  FlightPair pair(first, cpu);
  Commands start = split_by({"run.method = spring"});
  start.toggle_pause = true;
  pair.begin(pair.admit(start), nullptr, nullptr);
  pair.finish();
  Commands half;
  half.compare = Comparison::half_step;
  pair.begin(pair.admit(half), nullptr, nullptr);
  pair.finish();
  ASSERT_TRUE(pair.second());
  EXPECT_EQ(first.view().totals.num_steps, 0U);
  EXPECT_GT(first.view().dt_s, 0.0);
  EXPECT_DOUBLE_EQ(pair.second()->settings().dt_s, 0.5 * first.view().dt_s);
}

TEST(FlightPair, FiguresAreThoseOfTheFlights) {
  Settings settings = court(300);
  Pair both(settings, {"air.restitution = 0.1"});
  for (int frame = 0; frame < 41; ++frame) both.picture();
  const nlohmann::json report = both.pair.report();
  const FrameView& first = both.first.view();
  const FrameView& second = both.second().view();
  const Vec2d apart = first.ball.position_m - second.ball.position_m;
  EXPECT_NEAR(report["compared"]["distance_m"]["final"].get<double>(), std::hypot(apart.x, apart.y), 5e-6);
  EXPECT_GE(report["compared"]["distance_m"]["max"], report["compared"]["distance_m"]["final"]);
  const double start_j = second.flight_record->start_energy_j;
  const double now_j = both.second().backend().measure().energy_j();
  EXPECT_NEAR(report["compared"]["energy_drift"]["second"].get<double>(), now_j / start_j - 1.0, 1e-12);
  EXPECT_LT(report["compared"]["energy_drift"]["difference"].get<double>(), 0.0);
  const double cost = first.flight_record->compute_ms / first.flight_record->time_s();
  EXPECT_DOUBLE_EQ(report["compared"]["cost_ms_per_s"]["first"].get<double>(), cost);
  EXPECT_GT(report["compared"]["cost_ms_per_s"]["ratio"].get<double>(), 0.0);
  EXPECT_EQ(report["set"], nlohmann::json::array({"air.restitution = 0.1"}));
  EXPECT_EQ(report["second"]["restitution"], 0.1);
  EXPECT_EQ(report["second"]["state_hash"], fmt::format("{:016x}", hash_of(both.second())));
  EXPECT_EQ(report["second"]["steps"], second.totals.num_steps);
}

}  // namespace
}  // namespace pf::test
