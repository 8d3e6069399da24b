// The command line: output files, recordings, logs.
#include <gtest/gtest.h>

#include "core/file_ending.hpp"
#include "option_support.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

TEST(Options, OutputFilesAreCheckedAndKept) {
  TemporaryFolder folder;
  const std::string film = (folder.path() / "new.mp4").string();
  const std::string kept = folder.write("kept.json", "old").string();
  const Options options =
      options_of({"--record", film, "--report", kept, "--picture", (folder.path() / "a.PNG").string()});
  EXPECT_EQ(options.record, film);
  EXPECT_EQ(options.report, kept);
  EXPECT_FALSE(std::filesystem::exists(film));
  EXPECT_EQ(contents_of(kept), "old");
  EXPECT_EQ(options_of({"bench", "--json", kept}).bench_json, kept);
}

TEST(Options, RejectsUnwritableOutput) {
  TemporaryFolder folder;
  const std::string missing = (folder.path() / "no" / "a.mp4").string();
  const std::string message = refusal({"--record", missing});
  EXPECT_TRUE(contains(message, "--record: '" + missing + "' cannot be written: the folder '")) << message;
  std::filesystem::create_directory(folder.path() / "kept.mp4.toml");
  const std::string kept_film = folder.write("kept.mp4", "an earlier film").string();
  const std::string without_log = refusal({"--record", kept_film});
  EXPECT_TRUE(contains(without_log, "--record (the film's log): '" + kept_film + ".toml' cannot be written"))
      << without_log;
  EXPECT_TRUE(contains(message, "choose a file in a folder that exists and is writable")) << message;
  EXPECT_TRUE(contains(refusal({"--report", folder.path().string()}), "it is a folder"));
  EXPECT_TRUE(contains(refusal({"--report", "/proc/pf_report.json"}),
                       "--report: '/proc/pf_report.json' cannot be written"));
  EXPECT_TRUE(contains(refusal({"bench", "--json", "/proc/pf.json"}), "--json: "));
  EXPECT_TRUE(contains(refusal({"--report", ""}), "cannot be written"));
  const std::string long_name(300, 'x');
  EXPECT_TRUE(contains(refusal({"--save-scene", long_name + ".toml"}), "--save-scene: '"));
  EXPECT_TRUE(contains(refusal({"--record", long_name + "/%05d.png"}), "--record: '"));
}

// Files of a command line by their flags.
struct Clash {
  std::vector<std::string> words;
  const char* message;
};

TEST(Options, RejectsAnOutputThatCannotBeWrittenAside) {
  TemporaryFolder folder;
  const std::string report = folder.write("r.json", "{}").string();
  std::filesystem::create_directory(report + ".part");
  EXPECT_TRUE(contains(refusal({"--report", report}), "--report: '" + report + ".part' cannot be written"));
  EXPECT_TRUE(contains(refusal({"--report", "-"}), "for standard output give /dev/stdout"));
}

TEST(Options, RefusesAnOutputThatIsAnotherFile) {
  TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  const std::string scene = folder.write("s.toml", "[scene]\nname = \"s\"\n").string();
  const std::string list = folder.write("c.toml", "[[cue]]\n").string(), state = path("a.state");
  folder.write("a.state", "");
  std::filesystem::create_symlink("s.toml", path("link"));
  const std::vector<Clash> clashes = {
      {{"--scene", scene, "--log", scene}, "--log: '"},
      {{"--scene", scene, "--report", path("link")}, "is the file of --scene as well; choose another name"},
      {{"--scene", scene, "--overlay-csv", path("./s.toml")}, "--overlay-csv: '"},
      {{"--scene", scene, "--record", path("s/%05d.png")}, "--record (the film's log): '"},
      {{"--cues", list, "--log", list}, "is the file of --cues as well"},
      {{"--from", state, "--report", state}, "is the file of --from as well"},
      {{"--checkpoint", path("new"), "--report", path("new")}, "is the file of --report as well"},
      {{"--overlay-csv", path("x"), "--profile-csv", path("x")}, "is the file of --overlay-csv as well"},
      {{"--overlay-csv", "no-such-file.csv", "--profile-csv", "./no-such-file.csv"},
       "is the file of --overlay-csv as well"},
      {{"--record", path("%05d.png"), "--picture", path("00002.png")}, "is the file of --record as well"},
      {{"--still", "1", path("x.png"), "--picture", path("x.png")}, "is the file of --picture as well"},
      {{"--checkpoint", path("c"), "--report", path("c.part")}, "--checkpoint (while it is written): '"},
      {{"--picture", path("p.png"), "--overlay-csv", path("p.png.part")},
       "--picture (while it is written): '"},
      {{"--still", "1", path("p.png"), "--overlay-csv", path("p.png.part")},
       "--still (while it is written): '"},
      {{"--panel-map", path("m"), "--overlay-csv", path("m.frames")},
       "--panel-map (the number of frames): '"},
      {{"--save-scene", path("n.toml"), "--log", path("n.toml")}, "is the file of --log as well"},
  };
  for (const Clash& clash : clashes)
    EXPECT_TRUE(contains(refusal(clash.words), clash.message)) << refusal(clash.words);
  EXPECT_EQ(options_of({"--from", state, "--checkpoint", state}).data.checkpoint, state);
  EXPECT_EQ(options_of({"--report", "/dev/null", "--overlay-csv", "/dev/null"}).report, "/dev/null");
  EXPECT_EQ(options_of({"--report", "/dev/null", "--panel-map", "/dev/null"}).panel_map, "/dev/null");
  EXPECT_TRUE(contains(refusal({"--checkpoint", "/dev/null"}), "is not a regular file"));
}

#if PF_HAVE_HDF5
TEST(Options, RefusesTheFilesBesideADump) {
  TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  const std::string state = folder.write("b.xdmf", "").string(), dump = path("a.h5");
  const std::vector<Clash> clashes = {
      {{"--dump", dump, "--report", path("a.xdmf")}, "--dump (its index): '"},
      {{"--dump", dump, "--report", path("a.h5.part")}, "--dump (its first part): '"},
      {{"--dump", path("b.H5"), "--from", state}, "is the file of --from as well"},
      {{"--cues", "talk", "--dump", dump, "--report", path("a-2.h5")}, "--dump (number 2): '"},
      {{"--cues", "talk", "--dump", dump, "--report", path("a-3.xdmf")}, "--dump (its index): '"},
  };
  for (const Clash& clash : clashes)
    EXPECT_TRUE(contains(refusal(clash.words), clash.message)) << refusal(clash.words);
  EXPECT_EQ(options_of({"--dump", dump, "--report", path("a-2.h5")}).report, path("a-2.h5"));
}
#endif

TEST(Options, ALogReplacesOnlyALog) {
  TemporaryFolder folder;
  const std::string scene = folder.write("spin.toml", "[ball]\nspin_radps = -40\n").string();
  const std::string log = folder
                              .write("old.toml",
                                     "# Inputs of a flight. Replay it with: pickleflight run "
                                     "THIS_FILE\n")
                              .string();
  const std::string stem = scene.substr(0, scene.size() - 5);
  EXPECT_TRUE(contains(refusal({"--log", scene}), "--log: '" + scene + "' is there and is no log"));
  EXPECT_TRUE(contains(refusal({"--record", stem + "/%05d.png"}), "--record (the film's log): '"));
  EXPECT_TRUE(contains(refusal({"bench", "--frames", "2", "--record", stem + "/%05d.png"}),
                       "--record (the film's log): '"));
  const std::string filmed = (folder.path() / "b.mp4").string();
  EXPECT_TRUE(contains(refusal({"bench", "--frames", "2", "--record", filmed, "--json", filmed}),
                       "is the file of --record as well"));
  EXPECT_EQ(refusal({"bench", "--frames", "2", "--record", "/dev/null"}), "accepted");
  folder.write("a_frames.toml", "x = 1\\n");
  const std::string film = (folder.path() / "a.mp4").string(), path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);  // without ffmpeg
  EXPECT_TRUE(contains(refusal({"--record", film}), "--record (the log of its frames): '"));
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(refusal({"--record", (folder.path() / "a.rgb").string()}), "accepted");
  EXPECT_EQ(refusal({"--log", log}), "accepted");
  EXPECT_EQ(refusal({"--log", folder.write("empty.toml", "").string()}), "accepted");
}

TEST(Options, AStateHasItsOwnScene) {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--scene", "gas"}, {"--cues", "talk"}, {"--accuracy", "1%"}, {"--force"}}) {
    std::vector<std::string> words = {"--from", "a.state"};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(refusal(words), "--from: the file has its own scene and settings; leave out " + more[0]);
  }
}

TEST(Options, EndingsAreChecked) {
  EXPECT_TRUE(contains(refusal({"--record", "/tmp/a.avi"}),
                       "--record: '/tmp/a.avi' has the wrong ending; the file must "
                       "end in .mp4 or .mkv"));
  EXPECT_TRUE(contains(refusal({"--record", ""}), "wrong ending"));
  EXPECT_TRUE(contains(refusal({"--picture", "/tmp/a.jpg"}), "must end in .png"));
}

TEST(Options, EndingsCountInAnyCase) {
  EXPECT_EQ(ending_of("a.b/c.Mp4"), ".mp4");
  EXPECT_EQ(ending_of("a.b/c"), "");
  TemporaryFolder folder;
  const std::string scene = folder.write("S.TOML", "[scene]\nname = \"mine\"\n").string();
  const std::string log =
      folder.write("L.Toml", "scene = \"flown\"\n[[frame]]\nnumber = 9\nhash = \"00\"\n").string();
  EXPECT_EQ(options_of({"--scene", scene}).settings.name, "mine");
  EXPECT_TRUE(contains(refusal({"run", log, "--headless"}), "is not a log of a run"));  // but taken for one
  EXPECT_TRUE(contains(refusal({"--scene", scene, "--log", scene}), "is the file of --scene as well"));
  EXPECT_TRUE(
      contains(refusal({"--picture", (folder.path() / "p.SVG").string(), "--split"}), "--picture with .svg"));
}

TEST(Options, ReadsRecordingOptions) {
  const Options plain = options_of({});
  EXPECT_FALSE(plain.record_real_time || plain.record_panel || plain.still_s || plain.replay);
  EXPECT_TRUE(plain.record_overlay && plain.log.empty());
  EXPECT_EQ(plain.record_width_px, 0);
  const Options options = options_of({"--record", "a.rgb", "--record-time", "real", "--record-size",
                                      "1920x1080", "--record-panel", "--record-overlay", "off"});
  EXPECT_TRUE(options.record_real_time && options.record_panel && !options.record_overlay);
  EXPECT_EQ(options.record_width_px, 1920);
  EXPECT_EQ(options.record_height_px, 1080);
  EXPECT_TRUE(contains(refusal({"--record-time", "reel"}), "'reel' is unknown, the nearest is real"));
  EXPECT_TRUE(contains(refusal({"--record-overlay", "no"}), "one of on, off"));
  EXPECT_TRUE(contains(refusal({"--record-size", "1920"}), "--record-size: '1920' is not a size"));
  EXPECT_TRUE(contains(refusal({"--record-size", "641x360"}), "odd side"));
  EXPECT_TRUE(contains(refusal({"--log", "a.txt"}), "must end in .toml"));
}

TEST(Options, StillTakesATimeAndAFile) {
  const Options options = options_of({"--still", "0.25", "a.png"});
  EXPECT_EQ(options.still_s, 0.25);
  EXPECT_TRUE(options.headless);
  for (const char* time : {"x", "nan", "inf", "1e7", "0.1s", ""})
    EXPECT_TRUE(contains(refusal({"--still", time, "a.png"}), "is not a time; give seconds")) << time;
  EXPECT_TRUE(contains(refusal({"--still", "1", "a.jpg"}), "must end in .png"));
}

TEST(Options, WhatHasNoEffectWithoutAWindowIsRefused) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--full-screen"}, {"--clip", "3"}, {"--clip-format", "webp"}}) {
    std::vector<std::string> headless = words;
    headless.emplace_back("--headless");
    EXPECT_TRUE(contains(refusal(headless), words[0] + ": needs a window")) << words[0];
    EXPECT_EQ(refusal(words), "accepted") << words[0];
  }
  EXPECT_TRUE(
      contains(refusal({"--headless", "--picture-size", "320x200"}), "needs --picture FILE or --still"));
  EXPECT_EQ(refusal({"--headless", "--picture-size", "320x200", "--picture", "a.png"}), "accepted");
  EXPECT_EQ(refusal({"--picture-size", "320x200"}), "accepted") << "pictures by a key";
  EXPECT_TRUE(contains(refusal({"--headless", "--record-time", "real"}), "needs --record FILE"));
  EXPECT_TRUE(
      contains(refusal({"--still", "1", "a.png", "--seconds", "2"}), "run.seconds: --still T FILE ends"));
  EXPECT_TRUE(
      contains(refusal({"--still", "1", "a.png", "--set", "run.seconds=2"}), "leave out one of them"));
}

TEST(Options, SettingsWithoutEffectAreRefused) {
  const auto headless = [](std::vector<std::string> words) {
    words.emplace_back("--headless");
    return refusal(words);
  };
  const std::vector<std::string> ball = {"--scene", "gas", "--ball-spin", "4"},
                                 step = {"--dt", "0.001", "--set", "run.displacement_per_step=0.1"};
  const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  EXPECT_TRUE(contains(headless(ball), "--ball-spin: the scene has no ball"));
  EXPECT_EQ(headless(with(ball, {"--set", "ball.present=true"})), "accepted");
  EXPECT_EQ(refusal(ball), "accepted") << "a window may add the ball";
  EXPECT_TRUE(contains(headless(step), "has no effect beside a set time step"));
  EXPECT_EQ(headless(with(step, {"--split", "dt_s=0"})), "accepted") << "the second flight has its effect";
  EXPECT_EQ(headless({"--dt", "0", "--set", "run.displacement_per_step=0.1"}), "accepted");
}

TEST(Options, LogExcludesOtherSettings) {
  TemporaryFolder folder;
  const std::string log = folder
                              .write("a.toml",
                                     "scene = \"mine\"\nsettings = [\"ball.vx_mps = 3\"]\n"
                                     "[[frame]]\nnumber = 9\nhash = \"00\"\n")
                              .string();
  const Options options = options_of({"run", log, "--headless"});
  ASSERT_TRUE(options.replay);
  EXPECT_EQ(options.settings.name, "mine");
  EXPECT_EQ(options.settings.ball_vx_mps, 3.0);
  for (const std::vector<std::string>& more : {std::vector<std::string>{"-p", "5"},
                                               {"--scene", "gas"},
                                               {"--set", "run.seed=2"},
                                               {"--accuracy", "1%"},
                                               {"--still", "0", "a.png"}}) {
    std::vector<std::string> words = {"run", log};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_TRUE(contains(refusal(words), "a log has its own scene and settings; leave out " + more[0]));
  }
  EXPECT_TRUE(contains(refusal({"run", (folder.path() / "none.toml").string()}), "there is no such file"));
  // The flight does not depend on the number of threads.
  EXPECT_EQ(options_of({"run", log, "--headless", "--threads", "3"}).settings.threads, 3);
  EXPECT_EQ(options_of({"run", log, "--set", "run.threads=2"}).replay->settings.threads, 2);
  for (const std::string key : {"set = [\"run.threads = 4\"]", "scene = \"other\"\nsettings = []"}) {
    const std::string changing =
        folder.write("b.toml", "scene = \"mine\"\nsettings = []\n[[frame]]\nnumber = 9\n" + key + "\n")
            .string();
    EXPECT_EQ(refusal({"run", changing}), "accepted");
    EXPECT_TRUE(
        contains(refusal({"run", changing, "--threads", "3"}), "changes scene or threads on its way"));
  }
  const std::string from =
      folder
          .write("c.toml",
                 "scene = \"mine\"\nsettings = []\nfrom = \"a.state\"\nfrom_hash = \"00\"\n"
                 "[[frame]]\nnumber = 9\n")
          .string();
  EXPECT_EQ(options_of({"run", from, "--threads", "3"}).data.from_edits,
            std::vector<std::string>{"run.threads = 3"});
}

}  // namespace
}  // namespace pf
