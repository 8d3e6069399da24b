// Cue lists: reading, errors with their line, writing, the shipped talk, and going through a list.
#include <gtest/gtest.h>

#include "app/cue_player.hpp"
#include "app/replay.hpp"
#include "core/error.hpp"
#include "scene/cue_list.hpp"
#include "scene/scene_file.hpp"
#include "support/full_disk.hpp"
#include "support/scene_support.hpp"
#include "support/text.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

class CueLists : public testing::Test {
 protected:
  CueList load(const std::string& text) { return load_cue_list(folder_.write("t.toml", text).string()); }
  // The error for a list of this text, without the name of its folder.
  std::string refusal(const std::string& text) {
    try {
      load(text);
    } catch (const UserError& error) {
      const std::string message = error.what();
      EXPECT_FALSE(contains(message, "\n")) << message;
      const std::size_t at = message.find("t.toml");
      return at == std::string::npos ? message : message.substr(at);
    }
    return "accepted";
  }

  TemporaryFolder folder_;
};

TEST_F(CueLists, HaveSceneSettingsCameraAndTitle) {
  const CueList list = load(
      "[[cue]]\ntitle = \"A\"\nsubtitle = \"b\"\ntitle_s = 0\nscene = \"gas\"\nair.restitution = 0.5\n"
      "run.method = \"exact\"\ncamera = { center_m = [-4, 1.5], width_m = 5 }\npaused = true\n"
      "[[cue]]\n[cue.ball]\nspin_radps = -3\n");
  ASSERT_EQ(list.cues.size(), 2U);
  const Cue& first = list.cues[0];
  Settings expected = load_scene("gas");
  expected.restitution = 0.5;
  expected.method = Method::exact;
  EXPECT_EQ(first.settings, expected);
  EXPECT_EQ(first.title, "A");
  EXPECT_EQ(first.subtitle, "b");
  EXPECT_EQ(first.title_s, 0.0);
  EXPECT_TRUE(first.paused);
  ASSERT_TRUE(first.camera);
  EXPECT_EQ(first.camera->center_m, (Vec2d{-4.0, 1.5}));
  EXPECT_EQ(first.camera->width_m, 5.0);
  const Cue& second = list.cues[1];
  EXPECT_EQ(second.settings.name, "court");
  EXPECT_EQ(second.settings.ball_spin_radps, -3.0);
  EXPECT_FALSE(second.camera || second.paused);
  EXPECT_EQ(second.title_s, kTitle_s);
}

TEST_F(CueLists, ASceneMayLieBesideTheList) {
  folder_.write("mine.toml", "[air]\nrestitution = 0.25\n");
  EXPECT_EQ(load("[[cue]]\nscene = \"mine.toml\"\n").cues[0].settings.restitution, 0.25);
}

TEST_F(CueLists, EachErrorHasItsLineAndRemedy) {
  const std::string head = "[[cue]]\ntitle = \"A\"\n\n";
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"air.restituton = 1", "t.toml:4: 'air.restituton' is not a setting; the nearest is air.restitution"},
      {"air.restitution = 7", "t.toml:4: '7' is out of range; air.restitution takes a number from 0 to 1"},
      {"run.method = 3", "t.toml:4: run.method has a value of the wrong type"},
      {"subtitel = \"b\"", "t.toml:4: 'subtitel' is not a key of a cue; the nearest is subtitle"},
      {"title_s = -1", "t.toml:4: title_s takes a number from 0 to 3600"},
      {"title_s = \"5\"", "t.toml:4: title_s takes a number"},
      {"title_s = 9007199254740993", "t.toml:4: title_s takes a number"},
      {"subtitle = 3", "t.toml:4: subtitle takes a text in quotes"},
      {"subtitle = \"" + std::string(300, 'x') + "\"", "of at most 200 bytes"},
      {"scene = \"cort\"", "t.toml:4: scene: 'cort' is not a scene; the nearest is court"},
      {"scene = \"none.toml\"", "t.toml:4: scene: "},
      {"scene = 3", "t.toml:4: scene takes the name of a scene"},
      {"paused = 1", "t.toml:4: paused takes true or false"},
      {"camera = \"far\"", "t.toml:4: camera takes \"fit\""},
      {"camera = { center_m = [0, 0] }", "t.toml:4: camera takes \"fit\", or the middle and the width"},
      {"camera = { center_m = [0], width_m = 1 }", "t.toml:4: camera takes"},
      {"camera = { center_m = [0, 0], width_m = 0 }",
       "t.toml:4: width_m takes a number from 1e-06 to 1 million"},
      {"camera = { center_m = [0, nan], width_m = 1 }", "t.toml:4: center_m takes a number"},
      {"air = 3", "t.toml:4: air is a section"},
      {"run.threads = 2", "t.toml:4: run.threads holds for the whole run; leave it out and give --set"},
      {"run.frame_rate_hz = 30", "t.toml:4: run.frame_rate_hz holds for the whole run"},
      {"ball.x_m = 50", "t.toml:1: this cue cannot run: "},
      {"run.method = \"spring\"\nrun.dt_s = 0.01\nrun.spring_contact_s = 0.01",
       "stability bound of method spring"},
      {"air = ", "t.toml:4: not valid TOML: "},
  };
  for (const auto& [line, reason] : wrong) {
    const std::string message = refusal(head + line + "\n");
    EXPECT_TRUE(contains(message, reason)) << message;
  }
}

TEST_F(CueLists, AFileMustBeAList) {
  EXPECT_TRUE(contains(refusal("[air]\n"), "t.toml: is not a list of cues"));
  EXPECT_TRUE(contains(refusal("cue = 3\n"), "is not a list of cues"));
  EXPECT_TRUE(contains(refusal("cue = []\n"), "is not a list of cues"));
  EXPECT_TRUE(contains(refusal("cue = [3]\n"), "t.toml:1: a cue is a table"));
  EXPECT_TRUE(contains(refusal("scene = \"court\"\n[[cue]]\n"), "t.toml:1: 'scene' stands outside of a cue"));
  EXPECT_THROW(load_cue_list("no such talk"), UserError);
}

TEST_F(CueLists, AreToldFromScenesAndLogs) {
  EXPECT_TRUE(is_cue_list(folder_.write("a.toml", "# x\n[[cue]]\nbroken =")));
  EXPECT_TRUE(is_cue_list(folder_.write("a.toml", "  [[ cue ]]  # first\n")));
  EXPECT_FALSE(is_cue_list(folder_.write("a.toml", "[scene]\nname = \"[[cue]]\"\n")));
  EXPECT_FALSE(is_cue_list(folder_.write("a.toml", "[[frame]]\nnumber = 1\n")));
  EXPECT_FALSE(is_cue_list(folder_.path()));
  EXPECT_FALSE(is_cue_list(folder_.path() / "none.toml"));
}

TEST_F(CueLists, SaveTheStateAsACue) {
  Cue cue;
  cue.title = "Mine \"1\"";
  cue.settings = load_scene("regulation");
  cue.settings.num_parcels = cue.settings.num_parcels_cpu;  // chosen by the backend
  cue.settings.restitution = 1.0 / 3.0;
  cue.settings.method = Method::exact;
  cue.settings.threads = 3;
  cue.settings.follow_ball = !cue.settings.follow_ball;
  cue.camera = CueView{{0.25, -1.0}, 3.5};
  cue.paused = true;
  const auto file = folder_.path() / "new.toml";
  append_cue(file, cue, "cpu");
  cue.camera.reset();
  cue.paused = false;
  cue.settings.name = "of a file";  // no scene has the name
  append_cue(file, cue, "cpu");
  const CueList list = load_cue_list(file.string());
  ASSERT_EQ(list.cues.size(), 2U);
  Settings expected = load_scene("regulation");
  expected.restitution = 1.0 / 3.0;
  expected.method = Method::exact;
  expected.follow_ball = !expected.follow_ball;
  EXPECT_EQ(list.cues[0].settings, expected);
  EXPECT_EQ(list.cues[0].title, "Mine \"1\"");
  EXPECT_TRUE(list.cues[0].paused);
  EXPECT_EQ(list.cues[0].camera->center_m, (Vec2d{0.25, -1.0}));
  EXPECT_EQ(list.cues[1].settings.name, "court");
  EXPECT_EQ(list.cues[1].settings.areal_density_kg_m2, expected.areal_density_kg_m2);
  EXPECT_FALSE(list.cues[1].camera || list.cues[1].paused);
}

TEST_F(CueLists, TheNumberOfAnotherBackendIsKept) {
  Cue cue;
  cue.settings = load_scene("court");
  cue.settings.num_parcels = cue.settings.num_parcels_gpu;
  const auto file = folder_.path() / "new.toml";
  append_cue(file, cue, "cpu");
  append_cue(file, cue, "cuda");
  const CueList list = load_cue_list(file.string());
  EXPECT_EQ(list.cues[0].settings.num_parcels, cue.settings.num_parcels_gpu);
  EXPECT_EQ(list.cues[1].settings.num_parcels, 0);
}

TEST_F(CueLists, SavingChangesNoBrokenFile) {
  const auto file = folder_.write("broken.toml", "[[cue]]\ntitel = 1\n");
  EXPECT_THROW(append_cue(file, Cue{}, "cpu"), UserError);
  EXPECT_EQ(contents_of(file), "[[cue]]\ntitel = 1\n");
  EXPECT_THROW(append_cue(folder_.path() / "none" / "a.toml", Cue{}, "cpu"), UserError);
}

TEST_F(CueLists, SavingKeepsAListReadable) {
  std::string full = "[[cue]]\ntitle = \"without an end of line\"";
  const auto file = folder_.write("full.toml", full);
  append_cue(file, Cue{}, "cpu");
  EXPECT_EQ(load_cue_list(file.string()).cues.size(), 2U);
  for (int num = 1; num < 100; ++num) full += "\n[[cue]]";
  folder_.write("full.toml", full);
  const auto refusal_of = [](const std::filesystem::path& to, const Cue& cue) -> std::string {
    try {
      append_cue(to, cue, "cpu");
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_TRUE(contains(refusal_of(file, {}), "full.toml' has 100 cues already; choose another file"));
  EXPECT_EQ(contents_of(file), full);
  const auto large = folder_.write("large.toml", "#" + std::string((1 << 20) - 30, 'x') + "\n[[cue]]\n");
  EXPECT_TRUE(contains(refusal_of(large, {}), "would be larger than 1 MiB"));
  const std::string inline_cues = "cue = [{ title = \"A\" }]\n";
  const auto in_line = folder_.write("inline.toml", inline_cues);
  EXPECT_TRUE(contains(refusal_of(in_line, {}), "the cue is not saved"));
  EXPECT_EQ(contents_of(in_line), inline_cues);
  Cue wide;
  wide.camera = CueView{{0.0, 0.0}, 1e9};
  const auto other = folder_.path() / "wide.toml";
  EXPECT_TRUE(
      contains(refusal_of(other, wide), "the cue is not saved, since the list could not be loaded then: "));
  EXPECT_FALSE(std::filesystem::exists(other));
}

TEST_F(CueLists, SavingOnAFullDiskChangesNoList) {
  const std::string before = "[[cue]]\ntitle = \"A\"\n";
  const auto file = folder_.write("a.toml", before), other = folder_.path() / "b.toml";
  {
    const test::FullDisk full(before.size() + 10);
    EXPECT_THROW(append_cue(file, Cue{}, "cpu"), UserError);
    EXPECT_THROW(append_cue(other, Cue{}, "cpu"), UserError);
  }
  EXPECT_EQ(contents_of(file), before);
  EXPECT_FALSE(std::filesystem::exists(other)) << "so that it can be saved when there is room";
}

// Each cue of the shipped talk runs, with few parcels.
TEST(Talk, EachCueFlies) {
  const CueList list = load_cue_list("talk");
  ASSERT_GE(list.cues.size(), 5U);
  ASSERT_LE(list.cues.size(), 9U);  // each has a key
  for (const Cue& cue : list.cues) {
    Settings with = cue.settings;
    if (with.air == Air::parcels && with.num_parcels == 0) with.num_parcels = 1000;
    Simulation simulation(with, make_cpu_backend(1));
    for (int frame = 0; frame < 3; ++frame) simulation.advance_frame({}, nullptr);
    EXPECT_EQ(simulation.view().message, "") << cue.place;
    EXPECT_GT(simulation.view().simulated_s, 0.0) << cue.place;
    EXPECT_FALSE(cue.title.empty()) << cue.place;
  }
}

class Player : public testing::Test {
 protected:
  CueList list() {
    const auto file = folder_.write("t.toml",
                                    "[[cue]]\nair.num_parcels = 200\n"
                                    "[[cue]]\nair.num_parcels = 300\npaused = true\n"
                                    "[[cue]]\nscene = \"regulation\"\nair.num_parcels = 400\n");
    return load_cue_list(file.string());
  }
  TemporaryFolder folder_;
};

// A frame with the commands of the cues. Returns whether one began.
bool advance(Simulation& simulation, CuePlayer& cues, InputLog& log) {
  Commands commands;
  cues.add_commands(commands, simulation.view());
  log.begin_frame(commands, simulation);
  simulation.advance_frame(commands, nullptr);
  log.end_frame(simulation);
  return cues.follow(simulation.view());
}

TEST_F(Player, GoesThroughTheListAndTheLogReplaysIt) {
  CuePlayer cues(true);
  cues.load(list(), 0);
  Simulation simulation(cues.current_cue()->settings, make_cpu_backend(1));
  InputLog log(simulation, "cpu");
  const auto file = folder_.path() / "log.toml";
  log.open(file);
  EXPECT_TRUE(advance(simulation, cues, log));  // the first begins by itself
  EXPECT_FALSE(advance(simulation, cues, log));
  EXPECT_GT(simulation.view().simulated_s, 0.0);
  EXPECT_FALSE(cues.ask_next(-1));
  EXPECT_FALSE(cues.ask(3));
  ASSERT_TRUE(cues.ask_next(1));
  EXPECT_TRUE(advance(simulation, cues, log));
  EXPECT_EQ(cues.current(), 1);
  EXPECT_EQ(simulation.view().num_parcels, 300U);
  for (int frame = 0; frame < 3; ++frame) advance(simulation, cues, log);
  EXPECT_TRUE(simulation.view().paused);
  EXPECT_EQ(simulation.view().simulated_s, 0.0);  // paused before its first step
  cues.ask(2);
  for (int frame = 0; frame < 4; ++frame) advance(simulation, cues, log);
  EXPECT_FALSE(simulation.view().paused);
  EXPECT_EQ(simulation.settings().name, "regulation");
  log.close_all(simulation);
  const RunLog read = read_log(file);
  Simulation again(read.settings, make_cpu_backend(2));
  Replay replay(read);
  while (!replay.ended()) {
    again.advance_frame(replay.commands(again.settings()), nullptr);
    replay.end_frame(again);
  }
  EXPECT_EQ(again.backend().state_hash(), simulation.backend().state_hash());
  EXPECT_FALSE(replay.diverged()) << replay.summary();
}

TEST_F(Player, ARefusedCueChangesNothing) {
  CuePlayer cues(true);
  CueList three = list();
  three.cues[1].settings.ball_x_m = 50.0;  // outside the world
  cues.load(three, 0);
  Simulation simulation(cues.current_cue()->settings, make_cpu_backend(1));
  InputLog log(simulation, "cpu");
  advance(simulation, cues, log);
  cues.ask(1);
  for (int frame = 0; frame < 3; ++frame) EXPECT_FALSE(advance(simulation, cues, log));
  EXPECT_FALSE(cues.is_asked());
  EXPECT_EQ(cues.current(), 0);
  EXPECT_FALSE(simulation.view().paused);
  EXPECT_EQ(simulation.view().num_parcels, 200U);
  EXPECT_TRUE(contains(simulation.view().message, "outside the world"));
}

TEST_F(Player, GoesOnFromTheCueThatAnotherSceneEnded) {
  CuePlayer cues(true);
  cues.load(list(), 0);
  cues.mark(1);
  cues.mark(CuePlayer::kNone);
  EXPECT_EQ(cues.current_cue(), nullptr);
  ASSERT_TRUE(cues.ask_next(1));
  EXPECT_FALSE(cues.ask_next(1)) << "the third is the last";
  cues.load(list(), CuePlayer::kNone);
  Simulation simulation(test::court(100), make_cpu_backend(1));
  InputLog log(simulation, "cpu");
  ASSERT_TRUE(cues.ask_next(1));
  EXPECT_TRUE(advance(simulation, cues, log));
  EXPECT_EQ(cues.current(), 0) << "of another list the first";
}

TEST_F(Player, KeepsThreadsAndRateOfTheRun) {
  CuePlayer cues(false);
  cues.load(list(), CuePlayer::kNone);
  Settings with = test::court(100);
  with.threads = 1;
  with.frame_rate_hz = 24.0;
  Simulation simulation(with, make_cpu_backend(1));
  InputLog log(simulation, "cpu");
  cues.ask_next(1);
  EXPECT_TRUE(advance(simulation, cues, log));
  EXPECT_EQ(cues.current(), 0);
  cues.ask_next(1);
  for (int frame = 0; frame < 3; ++frame) advance(simulation, cues, log);
  EXPECT_FALSE(simulation.view().paused);  // nobody is there
  EXPECT_EQ(simulation.settings().frame_rate_hz, 24.0);
  EXPECT_EQ(simulation.settings().threads, 1);
}

}  // namespace
}  // namespace pf
