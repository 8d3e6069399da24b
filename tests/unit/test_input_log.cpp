// The log of a run, and its replay.
#include "app/input_log.hpp"

#include <gtest/gtest.h>

#include "backend/domains/domain_backend.hpp"
#include "core/error.hpp"
#include "support/full_disk.hpp"
#include "support/logged_flight.hpp"
#include "temporary_folder.hpp"

namespace pf::test {
namespace {

TEST(InputLog, ReplayGivesTheSameFlight) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  const std::uint64_t hash = fly_logged(file, 0, make_cpu_backend(2));
  const Flown flown = fly_again(file, make_cpu_backend(1));
  EXPECT_EQ(flown.hash, hash);
  EXPECT_EQ(flown.report["flown"], kNumFrames);
  EXPECT_EQ(flown.report["checks"], 2);  // after 60 frames and at the end
  EXPECT_EQ(flown.report["same"], true);
  EXPECT_NE(flown.summary.find("the same flight"), std::string::npos) << flown.summary;
}

// Launches by hand, comparisons, jumps back, the keys of the time scale, and frames held while aiming.
Commands launches_at(int frame) {
  Commands commands;
  commands.hold = frame >= 5 && frame < 9;
  if (frame == 8) commands.fly = BallLaunch{{11.0 / 3.0, 1.7}, -40.1};
  if (frame == 14) commands.compare = Comparison::half_step;
  if (frame == 20) commands.compare = Comparison::next_method;
  if (frame == 27) commands.time_scale_factor = 0.5;
  if (frame == 35) commands.back = true;
  return commands;
}

TEST(InputLog, ReplaysLaunchesByHand) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  Simulation simulation(court(500), make_cpu_backend(2));
  simulation.keep_checkpoints();
  InputLog log(simulation, "cpu");
  log.open(file);
  for (int frame = 0; frame < 45; ++frame) {
    log.begin_frame(launches_at(frame), simulation);
    simulation.advance_frame(launches_at(frame), nullptr);
    EXPECT_EQ(simulation.view().message, "") << "frame " << frame;
    log.end_frame(simulation);
  }
  log.close_all(simulation);
  const Flown flown = fly_again(file, make_cpu_backend(1));
  EXPECT_EQ(flown.hash, simulation.backend().state_hash());
  EXPECT_EQ(flown.report["same"], true) << flown.summary;
}

// Domains skip exact, which a backend of one domain would fly at that press of the key.
TEST(InputLog, ReplaysComparisonsOfDomainsInOne) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  Simulation simulation(court(500), make_domain_backend(std::make_shared<LocalCarrier>(), 2, 1));
  InputLog log(simulation, "cpu");
  log.open(file);
  std::vector<Method> methods;
  for (int frame = 0; frame < 15; ++frame) {
    Commands commands;
    if (frame == 3 || frame == 6) commands.compare = Comparison::next_method;
    log.begin_frame(commands, simulation);
    simulation.advance_frame(commands, nullptr);
    log.end_frame(simulation);
    if (frame % 3 == 0) methods.push_back(simulation.settings().method);
  }
  log.close_all(simulation);
  EXPECT_EQ(methods, (std::vector<Method>{Method::impulse, Method::spring, Method::impulse, Method::impulse,
                                          Method::impulse}));
  const Flown flown = fly_again(file, make_cpu_backend(1));
  EXPECT_EQ(flown.hash, simulation.backend().state_hash());
  EXPECT_EQ(flown.report["same"], true) << flown.summary;
}

// A film may start at any time. Its log contains the whole flight.
TEST(InputLog, OpenedLaterItHoldsTheWholeFlight) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  const std::uint64_t hash = fly_logged(file, 33, make_cpu_backend(2));
  EXPECT_EQ(fly_again(file, make_cpu_backend(2)).hash, hash);
}

TEST(InputLog, ChangedLineDivergesAtTheNextState) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  fly_logged(file, 0, make_cpu_backend(2));
  std::string text = contents_of(file);
  const std::size_t at = text.find("air.num_parcels = 444");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 21, "air.num_parcels = 445");
  const Flown flown = fly_again(folder.write("b.toml", text), make_cpu_backend(2));
  EXPECT_EQ(flown.report["same"], false);
  EXPECT_EQ(flown.report["first_divergence"]["frame"], kNumFrames - 1);
  EXPECT_EQ(flown.report["first_divergence"]["last_same_frame"], 59);
  EXPECT_NE(flown.summary.find("diverged: frame 69"), std::string::npos) << flown.summary;
}

// A killed program leaves a log without its end.
TEST(InputLog, TruncatedLogStillPlays) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  fly_logged(file, 0, make_cpu_backend(2));
  std::string text = contents_of(file);
  const Flown flown =
      fly_again(folder.write("b.toml", text.substr(0, text.rfind("\n[[frame]]"))), make_cpu_backend(2));
  EXPECT_EQ(flown.report["flown"], 65);  // up to its last input
  EXPECT_EQ(flown.report["same"], true);
}

TEST(InputLog, OnAFullDiskItEndsWithAWholeEntry) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  Simulation simulation(court(50), make_cpu_backend(1));
  InputLog log(simulation, "cpu");
  log.open(file);
  const std::uintmax_t room = std::filesystem::file_size(file) + 100;
  {
    const FullDisk full(room);
    Commands commands;
    commands.launch = true;
    for (int frame = 0; frame < 9; ++frame) {
      log.begin_frame(commands, simulation);
      simulation.advance_frame(commands, nullptr);
      log.end_frame(simulation);
    }
    log.close_all(simulation);
  }
  EXPECT_TRUE(log.failed());
  EXPECT_NE(log.take_failure().find("the log broke off"), std::string::npos);
  const std::string text = contents_of(file);
  EXPECT_LT(text.size(), room);
  EXPECT_EQ(text.back(), '\n');
  EXPECT_EQ(read_log(file).frames.size(), 2U);
}

TEST(InputLog, RejectsFilesThatAreNotLogs) {
  TemporaryFolder folder;
  const std::string head = "scene = \"x\"\nsettings = [\"air.num_parcels = 5\"]\n[[frame]]\n";
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"[scene]\nname = \"court\"\n", "is not a log of a run"},
      {"scene = \"x\"\nsettings = []\n", "ended before the log had an entry"},
      {"junk", "not valid TOML"},
      {head, "takes a number"},
      {head + "number = -1\n", "number takes a whole number from 0 to 1000000000000"},
      {head + "number = 1.5\n", "number takes a whole number"},
      {head + "number = 2000000000000\n", "number takes a whole number"},
      {head + "number = 9000000000000000001\n", "number takes finite numbers"},
      {"from_frame = 1e300\n" + head + "number = 1\n", "from_frame takes a whole number"},
      {head + "number = 1\npress = [\"rest\"]\n", "the nearest is reset"},
      {head + "number = 1\nset = [\"air.restitution = 3\"]\n", "is out of range"},
      {head + "number = 1\nset = [\"air.restituton = 1\"]\n", "the nearest is air.restitution"},
      {head + "number = 5\n[[frame]]\nnumber = 4\n", "sort the frames"},
      {head + "number = 1\nhash = 5\n", "hash takes a text"},
      {head + "number = 1\nfly = [1.0, 2.0]\n", "fly takes velocity and spin"},
      {head + "number = 1\nfly = [1.0, 2.0, inf]\n", "fly takes finite numbers"},
      {head + "number = 1\ncompare = \"other\"\n", "compare takes one of"},
      {head + "number = 1\ncompare = \"next_method\"\nmethod = \"euler\"\n", "method takes one of impulse"},
      {head + "number = 1\ntime_scale_factor = 0\n", "takes a number above 0"},
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
}  // namespace pf::test
