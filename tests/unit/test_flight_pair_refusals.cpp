// What two flights cannot do is said in one line, and both fly on as they did.
#include <gtest/gtest.h>

#include <string>

#include "core/error.hpp"
#include "support/flight_pair_support.hpp"

namespace pf::test {
namespace {

TEST(FlightPair, RefusesWhatCannotBeComparedInOneLine) {
  Simulation first(court(300), make_cpu_backend(2));
  FlightPair pair(first, cpu);
  for (int frame = 0; frame < 5; ++frame) first.advance_frame({}, nullptr);
  const auto refusal_of = [&](const Difference& difference) {
    pair.begin(pair.admit(split_by(difference)), nullptr, nullptr);
    pair.finish();
    EXPECT_FALSE(pair.second());
    return pair.view().message;
  };
  const std::string unstable =
      refusal_of({"run.method = spring", "run.spring_contact_s = 1e-6", "run.dt_s = 0.001"});
  EXPECT_NE(unstable.find("--split: the second half cannot fly: "), std::string::npos) << unstable;
  EXPECT_EQ(unstable.find('\n'), std::string::npos);
  EXPECT_GT(first.view().simulated_s, 0.0) << "the first one flies on";
  EXPECT_GT(first.view().flight_record->points_m.size(), 5U);
  pair.begin(pair.admit({}), nullptr, nullptr);
  pair.finish();
  EXPECT_EQ(pair.view().message, unstable) << "until the next input";
  Commands pause;
  pause.toggle_pause = true;
  pair.begin(pair.admit(pause), nullptr, nullptr);
  pair.finish();
  EXPECT_EQ(pair.view().message, "");
}

TEST(FlightPair, ARefusedDifferenceLeavesTheSecondFlight) {
  Pair both(court(300), {"air.restitution = 0.3"});
  for (int frame = 0; frame < 5; ++frame) both.picture();
  const double flown_s = both.second().view().simulated_s;
  const Commands admitted =
      both.pair.admit(split_by({"run.method = spring", "run.spring_contact_s = 1e-6", "run.dt_s = 0.001"}));
  EXPECT_FALSE(admitted.split) << "nothing to log";
  both.pair.begin(admitted, nullptr, nullptr);
  both.pair.finish();
  EXPECT_NE(both.pair.view().message.find("the second half cannot fly"), std::string::npos);
  ASSERT_TRUE(both.pair.second());
  EXPECT_GT(both.second().view().simulated_s, flown_s);
  EXPECT_EQ(both.pair.difference(), Difference{"air.restitution = 0.3"});
}

// The log then says that the second flight ends.
TEST(FlightPair, ASecondFlightThatLacksADeviceEnds) {
  Simulation first(court(300), make_cpu_backend(1));
  int num_made = 0;
  FlightPair pair(first, [&](const std::string& name, std::int64_t threads) {
    if (++num_made > 1) throw DeviceError("no device");
    return cpu(name, threads);
  });
  pair.begin(pair.admit(split_by({"air.restitution = 0.3"})), nullptr, nullptr);
  pair.finish();
  ASSERT_TRUE(pair.second());
  const Commands admitted = pair.admit(split_by({"air.restitution = 0.4"}));
  EXPECT_EQ(admitted.split, Difference{});
  EXPECT_FALSE(pair.second());
  EXPECT_EQ(pair.view().message, "no device");
}

TEST(FlightPair, RefusesEditsThatTheSecondCannotFollow) {
  Pair both(court(300), {"run.method = spring"});
  const Settings before = both.first.settings();
  both.picture(edit(before, [](Settings& s) { s.spring_contact_s = 1e-7, s.dt_s = 1e-3; }));
  EXPECT_EQ(both.pair.view().message.substr(0, 13), "Second half: ") << both.pair.view().message;
  ASSERT_TRUE(both.pair.second());
  EXPECT_EQ(both.first.settings(), before);
  both.picture(edit(before, [](Settings& s) { s.restitution = 0.5; }));
  EXPECT_EQ(both.pair.view().message, "");
  EXPECT_EQ(both.second().settings().restitution, 0.5);
}

// One parcel would be wider than half the court, with either method.
TEST(FlightPair, RefusesWithTheWordsOfOneFlightWhatNeitherCanFollow) {
  Pair both(court(300), {"run.method = spring"});
  both.picture(edit(both.first.settings(), [](Settings& s) { s.num_parcels = 1; }));
  EXPECT_EQ(both.pair.view().message.substr(0, 14), "air: 1 parcel ") << both.pair.view().message;
  EXPECT_EQ(both.first.settings().num_parcels, 300);
}

}  // namespace
}  // namespace pf::test
