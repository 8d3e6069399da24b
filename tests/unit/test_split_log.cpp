// Logs of two flights: replayed, both are the same, also where commands have cut frames.
#include <gtest/gtest.h>

#include <random>

#include "app/flight_pair.hpp"
#include "app/input_log.hpp"
#include "app/replay.hpp"
#include "core/error.hpp"
#include "support/scene_support.hpp"
#include "temporary_folder.hpp"

namespace pf::test {
namespace {

constexpr double kMin_ms = 1e-6;  // every request ends after a step, or within one

std::unique_ptr<Backend> cpu(const std::string&, std::int64_t threads) {
  return make_cpu_backend(static_cast<unsigned>(threads));
}

Settings scene() {
  Settings settings = court(800);
  settings.method = Method::exact;
  settings.frame_budget_ms = kMin_ms;
  settings.threads = 2;
  return settings;
}

Commands random_commands(std::mt19937_64& random, const FrameView& view) {
  Commands commands;
  const auto edit = [&](auto change) {
    commands.settings = view.asked ? *view.asked : *view.settings;
    change(*commands.settings);
  };
  switch (random() % 60) {
    case 0:
      edit([](Settings& s) { s.restitution = s.restitution > 0.5 ? 0.4 : 0.9; });
      break;
    case 1:
      commands.toggle_pause = true;
      break;
    case 2:
      commands.single_step = view.paused;
      break;
    case 3:
      commands.reset = random() % 3 == 0;
      break;
    case 4:
      commands.launch = true;
      break;
    case 5:
      commands.fly = BallLaunch{{12.0, 1.0 / 3.0}, -20.0};
      break;
    case 6:
      commands.time_scale_factor = view.settings->time_scale > 0.05 ? 0.5 : 2.0;
      break;
    case 7:
      commands.back = true;
      break;
    case 8:
      commands.compare = random() % 2 == 0 ? Comparison::next_method : Comparison::half_step;
      break;
    case 9:
      commands.hold = true;
      break;
    case 10:
      if (random() % 4 == 0) commands.split.emplace();
      break;
    case 11:
      commands.split = {"run.method = impulse"};
      break;
    case 12:
    case 13: {
      const auto num_frames = static_cast<std::uint64_t>(view.history->latest());
      commands.seek_s = view.history->time_at(static_cast<std::int64_t>(random() % (num_frames + 1)));
      break;
    }
    default:
      break;
  }
  return commands;
}

struct Logged {
  std::uint64_t first = 0;
  std::optional<std::uint64_t> second;
};

Logged hashes_of(Simulation& first, FlightPair& pair) {
  Logged hashes = {first.backend().state_hash(), std::nullopt};
  if (pair.second()) hashes.second = pair.second()->backend().state_hash();
  return hashes;
}

// A window's run with a budget.
// seed: of the person's commands; none: there are none but the first.
Logged fly_logged(const std::filesystem::path& file, std::optional<std::uint64_t> seed) {
  std::mt19937_64 random(seed.value_or(0));
  Simulation first(scene(), make_cpu_backend(2));
  FlightPair pair(first, cpu);
  pair.keep_checkpoints();
  pair.keep_to_budget();
  InputLog log(first, "cpu");
  log.set_pair(&pair);
  log.open(file);
  for (int picture = 0; picture < 1500 || !pair.is_whole(); ++picture) {
    Commands wanted;
    if (picture == 3) wanted.split = {"run.method = impulse"};
    if (seed && picture > 3 && picture < 1500) wanted = random_commands(random, pair.view());
    const Commands commands = pair.admit(wanted);
    if (pair.first_goes()) log.begin_frame(commands, first);
    pair.begin(commands, nullptr, nullptr);
    pair.finish();
    if (pair.first_goes()) log.end_frame(first);
  }
  log.close_all(first);
  return hashes_of(first, pair);
}

Logged fly_again(const RunLog& log, Replay& replay) {
  Simulation first(log.settings, make_cpu_backend(1));
  FlightPair pair(first, cpu);
  pair.keep_checkpoints();
  pair.follow_log();
  while (!replay.ended()) {
    pair.begin(pair.admit(replay.commands(first.settings())), nullptr, nullptr);
    pair.finish();
    replay.end_frame(first, pair.second());
  }
  return hashes_of(first, pair);
}

TEST(SplitLog, CutFlightsReplay) {
  int num_cut = 0;
  int num_second_hashes = 0;
  int num_seeks = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 24, 26, 60}) {
    TemporaryFolder folder;
    const auto file = folder.path() / "a.toml";
    const Logged flown = fly_logged(file, seed);
    const RunLog log = read_log(file);
    for (const LoggedFrame& frame : log.frames) {
      num_cut += frame.second.max_steps ? 1 : 0;
      num_second_hashes += frame.second.hash.empty() ? 0 : 1;
      num_seeks += frame.seek_s ? 1 : 0;
    }
    Replay replay(log);
    const Logged again = fly_again(log, replay);
    EXPECT_FALSE(replay.diverged()) << replay.summary() << ", seed " << seed;
    EXPECT_EQ(again.first, flown.first) << "seed " << seed;
    EXPECT_EQ(again.second, flown.second) << "seed " << seed;
  }
  EXPECT_GT(num_cut, 10);
  EXPECT_GT(num_second_hashes, 6);
  EXPECT_GT(num_seeks, 20);
}

TEST(SplitLog, AnotherSecondFlightDiverges) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  fly_logged(file, std::nullopt);
  std::string text = contents_of(file);
  const std::string split = "split = [\"run.method = impulse\"]";
  ASSERT_NE(text.find(split), std::string::npos);
  for (std::size_t at = text.find(split); at != std::string::npos; at = text.find(split))
    text.replace(at, split.size(), "split = [\"air.restitution = 0.2\"]");
  const RunLog log = read_log(folder.write("b.toml", text));
  Replay replay(log);
  fly_again(log, replay);
  EXPECT_TRUE(replay.diverged()) << replay.summary();
}

TEST(SplitLog, BadDifferenceIsRefusedWithItsLine) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.toml";
  fly_logged(file, 1);
  const auto bad = folder.write(
      "b.toml", contents_of(file) + "\n[[frame]]\nnumber = 99999\nsplit = [\"air.num_parcels = 3\"]\n");
  try {
    read_log(bad);
    FAIL() << "read";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("--split: air.num_parcels cannot differ"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace pf::test
