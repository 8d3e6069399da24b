// Checkpoints: a run goes on to the same bits; what is not a whole checkpoint is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/run_state.hpp"
#include "core/error.hpp"
#include "data/checkpoint_file.hpp"
#include "data/random_scenes.hpp"
#include "data/read_start.hpp"
#include "data/run_state_json.hpp"
#include "unit/temporary_folder.hpp"

namespace pf::test {
namespace {

constexpr unsigned kNumScenes = 30;

class Checkpoint : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "a.state";

  // Runs a scene to its end and saves it on the way.
  End run(const RandomScene& scene) {
    Simulation simulation(scene.settings, make_cpu_backend(2));
    advance(simulation, scene.saved_after);
    RunState state;
    simulation.save(state);
    EXPECT_EQ(state_hash(state), simulation.backend().state_hash()) << scene.text;
    write_checkpoint(file_, state);
    advance(simulation, scene.num_frames - scene.saved_after);
    return end_of(simulation);
  }
  std::string refusal() const {
    try {
      read_checkpoint(file_);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
  void save_small() {
    Simulation simulation(random_scene(2).settings, make_cpu_backend(1));  // exact, open world
    advance(simulation, 3);
    RunState state;
    simulation.save(state);
    write_checkpoint(file_, state);
  }
};

TEST_F(Checkpoint, GoesOnToTheSameBits) {
  for (unsigned number = 0; number < kNumScenes; ++number) {
    const RandomScene scene = random_scene(number);
    const End expected = run(scene);
    Simulation again(read_checkpoint(file_), make_cpu_backend(1));
    advance(again, scene.num_frames - scene.saved_after);
    EXPECT_EQ(end_of(again), expected) << scene.text << ", saved after frame " << scene.saved_after;
    EXPECT_GT(expected.num_steps, 0U) << scene.text;
  }
}

TEST_F(Checkpoint, AProfileIsShownFromTheStart) {
  Settings settings = gas(100);
  settings.profile = ProfileAxis::x;
  Simulation simulation(settings, make_cpu_backend(1));
  RunState state;
  simulation.save(state);
  const Simulation again(state, make_cpu_backend(1));
  ASSERT_NE(again.view().profile, nullptr);
  EXPECT_EQ(again.view().profile->bins, simulation.view().profile->bins);
}

// A gas of `exact` that has cooled so far that its ticks are long.
TEST_F(Checkpoint, KeepsLongTicks) {
  RandomScene scene;
  scene.settings = golden_gas(Method::exact, Boundary::periodic, 0.6, 0.3);
  scene.settings.dt_s = 1e3;
  scene.settings.substeps = 2;
  scene.settings.contact_clock = 0.1;
  scene.num_frames = 24;
  for (const int saved_after : {3, 11, 17}) {
    scene.saved_after = saved_after;
    const End expected = run(scene);
    const RunState state = read_checkpoint(file_);
    if (saved_after == 17) {
      EXPECT_GT(state.backend.exact.tick_exponent, 0U);
    }
    Simulation again(state, make_cpu_backend(1));
    advance(again, scene.num_frames - saved_after);
    EXPECT_EQ(end_of(again), expected) << "saved after frame " << saved_after;
  }
}

// Which parcels are heated decides about the impulses of the next step.
TEST_F(Checkpoint, KeepsHeatedParcels) {
  RandomScene scene = heating_scene(0);
  int num_with_heated = 0, num_changed = 0;
  for (scene.saved_after = 2; scene.saved_after < scene.num_frames; ++scene.saved_after) {
    const End expected = run(scene);
    RunState state = read_checkpoint(file_);
    const int num_left = scene.num_frames - scene.saved_after;
    Simulation again(state, make_cpu_backend(1));
    advance(again, num_left);
    EXPECT_EQ(end_of(again), expected) << "saved after frame " << scene.saved_after;
    num_with_heated += state.backend.parcels.heated.empty() ? 0 : 1;
    state.backend.parcels.heated.clear();
    Simulation forgetful(state, make_cpu_backend(1));
    advance(forgetful, num_left);
    num_changed += end_of(forgetful).state_hash == expected.state_hash ? 0 : 1;
  }
  EXPECT_GE(num_with_heated, 5);
  EXPECT_GE(num_changed, 3);
}

TEST_F(Checkpoint, RefusesHeatedParcelsThatCannotBe) {
  Simulation simulation(heating_scene(0).settings, make_cpu_backend(1));
  RunState state;
  simulation.save(state);
  for (const std::vector<std::uint32_t>& heated :
       {std::vector<std::uint32_t>{3, 5, 999}, {3, 3}, {5, 3}, {3, 1000}}) {
    state.backend.parcels.heated = heated;
    write_checkpoint(file_, state);
    const bool is_refused = refusal().find("its arrays do not fit its settings") != std::string::npos;
    EXPECT_EQ(is_refused, heated.size() == 2) << heated[1];
  }
}

// The air of each launch has a seed of its own, and the ball leaves several times.
TEST_F(Checkpoint, GoesOnThroughLaunches) {
  RandomScene scene;
  scene.settings = court(200);
  scene.settings.ball_vx_mps = 60.0;
  scene.settings.time_scale = 1.0;
  scene.settings.max_substeps = 4;
  scene.num_frames = 260;
  for (const int saved_after : {5, 40, 120}) {
    scene.saved_after = saved_after;
    const End expected = run(scene);
    Simulation again(read_checkpoint(file_), make_cpu_backend(1));
    advance(again, scene.num_frames - saved_after);
    EXPECT_EQ(end_of(again), expected) << "saved after frame " << saved_after;
  }
}

// Saving changes nothing, and a run that goes on from a run that went on ends alike.
TEST_F(Checkpoint, CanBeSavedAgainAndAgain) {
  const RandomScene scene = random_scene(8);
  const End expected = run(scene);
  RunState state;
  Simulation(scene.settings, make_cpu_backend(1)).save(state);
  for (int frame = 0; frame < scene.num_frames; ++frame) {
    Simulation next(state, make_cpu_backend(1 + frame % 3));
    advance(next, 1);
    next.save(state);
    write_checkpoint(file_, state);
    state = read_checkpoint(file_);
  }
  Simulation last(state, make_cpu_backend(1));
  EXPECT_EQ(end_of(last), expected);
}

TEST_F(Checkpoint, KeepsPathAndSettings) {
  Settings s = random_scene(5).settings;
  s.description = "one \"line\", with quotes and \\";
  Simulation simulation(s, make_cpu_backend(1));
  advance(simulation, 4);
  RunState state;
  simulation.save(state);
  state.num_frames = 4;
  state.initial.momentum_kg_mps = {1.0 / 3.0, -2.0 / 7.0};
  write_checkpoint(file_, state);
  const RunState read = read_checkpoint(file_);
  EXPECT_EQ(read.settings, simulation.settings());
  EXPECT_EQ(read.flight.points_m, state.flight.points_m);
  EXPECT_EQ(read.flight.times_s, state.flight.times_s);
  EXPECT_EQ(read.num_frames, 4);
  EXPECT_EQ(read.initial.momentum_kg_mps, state.initial.momentum_kg_mps);
}

// As of a flight that was launched again after its parcels had blown up.
TEST_F(Checkpoint, KeepsWhatIsNoNumber) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Simulation simulation(random_scene(2).settings, make_cpu_backend(1));
  RunState state;
  simulation.save(state);
  state.flight.end_energy_j = kNan;
  state.totals.ball_impulse_kg_mps = {kNan, 1.0};
  write_checkpoint(file_, state);
  const RunState read = read_checkpoint(file_);
  ASSERT_TRUE(read.flight.end_energy_j);
  EXPECT_TRUE(std::isnan(*read.flight.end_energy_j));
  EXPECT_TRUE(std::isnan(read.totals.ball_impulse_kg_mps.x));
  EXPECT_EQ(read.totals.ball_impulse_kg_mps.y, 1.0);
}

TEST_F(Checkpoint, RefusesEveryCut) {
  save_small();
  const std::string whole = contents_of(file_);
  EXPECT_EQ(refusal(), "");
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 200) {
    folder_.write("a.state", whole.substr(0, size));
    EXPECT_NE(refusal(), "") << "the first " << size << " of " << whole.size() << " bytes were read";
  }
  folder_.write("a.state", whole + "x");
  EXPECT_NE(refusal().find("has 1 bytes too many"), std::string::npos) << refusal();
}

TEST_F(Checkpoint, RefusesEveryFlippedBit) {
  save_small();
  const std::string whole = contents_of(file_);
  std::mt19937 random(7);
  for (int flip = 0; flip < 400; ++flip) {
    std::string damaged = whole;
    // The first lines bit by bit, the rest at random.
    const std::size_t at = flip < 100 ? static_cast<std::size_t>(flip) : random() % whole.size();
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
    folder_.write("a.state", damaged);
    EXPECT_NE(refusal(), "") << "a flipped bit in byte " << at << " was not noticed";
  }
}

TEST_F(Checkpoint, NamesTheReason) {
  folder_.write("a.state", "[scene]\nname = \"court\"\n");
  EXPECT_NE(refusal().find("is no checkpoint; give a file that --checkpoint or --dump FILE.h5 has written"),
            std::string::npos);
  folder_.write("a.state", "pickleflight checkpoint 4\n{}\n{}\n");
  EXPECT_NE(refusal().find("has format '4', and this program reads 3"), std::string::npos) << refusal();
  folder_.write("a.state", "");
  EXPECT_NE(refusal().find("is empty"), std::string::npos) << refusal();
  std::filesystem::remove(file_);
  EXPECT_NE(refusal().find("does not exist"), std::string::npos) << refusal();
  std::filesystem::create_directory(file_);
  EXPECT_NE(refusal().find("is a folder"), std::string::npos) << refusal();
}

// Such as a checksum does not notice, since somebody has made a new one.
TEST_F(Checkpoint, RefusesNumbersThatCannotBe) {
  Simulation simulation(random_scene(2).settings, make_cpu_backend(1));
  advance(simulation, 3);
  RunState state;
  simulation.save(state);
  const std::string whole = run_state_text(state, {});
  const auto refusal_with = [&](const char* part, const char* key, const char* value) -> std::string {
    nlohmann::json damaged = nlohmann::json::parse(whole);
    damaged.at(part).at(key) = nlohmann::json::parse(value);
    try {
      run_state_from_text(damaged.dump(), {}, "a.state");
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal_with("flight", "method", "2"), "");
  EXPECT_EQ(refusal_with("flight", "method", "7"),
            "a.state: the state of the run is damaged: flight.method is '7', and must be a whole number from "
            "0 to 2; "
            "give an earlier checkpoint, or another frame of a dump");
  EXPECT_EQ(refusal_with("exact", "ball_tick", "-5"), "");
  EXPECT_EQ(refusal_with("totals", "event_hash", "18446744073709551615"), "");
  const char* const wrong[][3] = {{"flight", "air", "3"},
                                  {"flight", "method", "-1"},
                                  {"flight", "method", "1.5"},
                                  {"flight", "dt_s", "null"},
                                  {"flight", "launch_mps", "[1e200, 0.0]"},
                                  {"flight", "launch_mps", "[0.0, null]"},
                                  {"totals", "num_steps", "-1"},
                                  {"totals", "num_steps", "1e300"},
                                  {"totals", "first_invalid_id", "4294967296"},
                                  {"totals", "ball_impulse_kg_mps", "[1.0]"},
                                  {"run", "num_frames", "-1"},
                                  {"run", "num_frames", "true"},
                                  {"run", "landed", "1"},
                                  {"run", "exact_s", "-1"},
                                  {"run", "simulated_s", "null"},
                                  {"run", "ball_distance_m", "\"far\""},
                                  {"exact", "tick_exponent", "41"},
                                  {"exact", "ball_tick", "2147483648"}};
  for (const auto& [part, key, value] : wrong) {
    const std::string name = std::string(part) + "." + key;
    EXPECT_NE(
        refusal_with(part, key, value).find("a.state: the state of the run is damaged: " + name + " is "),
        std::string::npos)
        << name << " = " << value << ": " << refusal_with(part, key, value);
  }
  nlohmann::json without = nlohmann::json::parse(whole);
  without.at("run").erase("paused");
  EXPECT_THROW(run_state_from_text(without.dump(), {}, "a.state"), UserError);
}

TEST_F(Checkpoint, RefusesTicksInWhichTheWorldIsCrossed) {
  Simulation simulation(random_scene(2).settings, make_cpu_backend(1));
  advance(simulation, 3);
  RunState state;
  simulation.save(state);
  ASSERT_TRUE(state.backend.exact.active);
  for (const std::uint32_t exponent : {0U, 40U}) {
    state.backend.exact.tick_exponent = exponent;
    write_checkpoint(file_, state);
    Options options;
    options.data.from = file_;
    if (exponent == 0) {
      EXPECT_NO_THROW(read_start(options));
    } else {
      EXPECT_THROW(read_start(options), UserError);
    }
  }
}

// The link stays one, and its target is the new checkpoint.
TEST_F(Checkpoint, ReplacesTheTargetOfALink) {
  save_small();
  const std::filesystem::path link = folder_.path() / "link.state";
  std::filesystem::create_symlink("a.state", link);
  Simulation simulation(random_scene(1).settings, make_cpu_backend(1));
  RunState state;
  simulation.save(state);
  const std::string before = contents_of(file_);
  write_checkpoint(link, state);
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_NE(contents_of(file_), before);
  EXPECT_TRUE(is_checkpoint(link));
}

// The one before stays.
TEST_F(Checkpoint, IsKeptWhenTheNextOneCannotBeWritten) {
  save_small();
  const std::string whole = contents_of(file_);
  std::filesystem::create_directory(folder_.path() / "a.state.part");
  Simulation simulation(random_scene(0).settings, make_cpu_backend(1));
  RunState state;
  simulation.save(state);
  EXPECT_THROW(write_checkpoint(file_, state), UserError);
  EXPECT_EQ(contents_of(file_), whole);
}

TEST_F(Checkpoint, LeavesNothingBesideAFolderOfItsName) {
  std::filesystem::create_directory(file_);
  EXPECT_THROW(write_checkpoint(file_, {}), UserError);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "a.state.part"));
}

}  // namespace
}  // namespace pf::test
