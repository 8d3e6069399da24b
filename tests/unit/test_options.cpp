// The command line.
#include <gtest/gtest.h>

#include "app/options.hpp"
#include "core/error.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

ParseResult parse(const std::vector<std::string>& words) {
  std::vector<const char*> argv = {"pickleflight"};
  for (const std::string& word : words) argv.push_back(word.c_str());
  return parse_options(static_cast<int>(argv.size()), argv.data());
}

Options options_of(const std::vector<std::string>& words) { return parse(words).options.value(); }

std::string refusal(const std::vector<std::string>& words) {
  try {
    parse(words);
  } catch (const UserError& error) {
    EXPECT_FALSE(contains(error.what(), "\n")) << error.what();
    return error.what();
  }
  return "accepted";
}

TEST(Options, NothingRunsTheCourt) {
  const Options options = options_of({});
  EXPECT_EQ(options.command, Command::run);
  EXPECT_EQ(options.settings.name, "court");
  EXPECT_FALSE(options.show_path || options.cuda || options.cuda_no_fallback || options.headless);
  EXPECT_TRUE(options.show_panel);
  EXPECT_EQ(options.draw_target, "auto");
  EXPECT_TRUE(options.record.empty() && options.report.empty() && options.picture.empty());
}

TEST(Options, TheSeedsCommandLineWorks) {
  const Options options = options_of({"-t", "--cuda", "--cuda-no-fallback", "-p", "20000", "--ball-vx",
                                      "-3.5", "--ball-vy", "1e1", "--ball-spin", "-157"});
  EXPECT_TRUE(options.show_path && options.cuda && options.cuda_no_fallback);
  EXPECT_EQ(options.settings.num_parcels, 20000);
  EXPECT_EQ(options.settings.ball_vx_mps, -3.5);
  EXPECT_EQ(options.settings.ball_vy_mps, 10.0);
  EXPECT_EQ(options.settings.ball_spin_radps, -157.0);
}

TEST(Options, NoFallbackMeansCuda) {
  EXPECT_TRUE(options_of({"--cuda-no-fallback"}).cuda);
  EXPECT_FALSE(options_of({"--cuda"}).cuda_no_fallback);
}

TEST(Options, EveryFlagReachesItsPlace) {
  const Options options = options_of(
      {"run",   "--method",   "spring",     "--neighbors",   "all-pairs", "--threads", "3",      "--dt",
       "0.001", "--substeps", "4",          "--time-scale",  "0.5",       "--seed",    "9",      "--seconds",
       "2.5",   "--headless", "--no-panel", "--draw-target", "staged",    "--size",    "800x601"});
  EXPECT_EQ(options.settings.method, Method::spring);
  EXPECT_EQ(options.settings.neighbors, Neighbors::all_pairs);
  EXPECT_EQ(options.settings.threads, 3);
  EXPECT_EQ(options.settings.dt_s, 0.001);
  EXPECT_EQ(options.settings.substeps, 4);
  EXPECT_EQ(options.settings.time_scale, 0.5);
  EXPECT_EQ(options.settings.seed, 9);
  EXPECT_EQ(options.settings.seconds, 2.5);
  EXPECT_TRUE(options.headless);
  EXPECT_FALSE(options.show_panel);
  EXPECT_EQ(options.draw_target, "staged");
  EXPECT_EQ(options.width_px, 800);
  EXPECT_EQ(options.height_px, 601);
}

TEST(Options, EveryFlagOfTheShowReachesItsPlace) {
  TemporaryFolder folder;
  const std::string csv = (folder.path() / "o.csv").string(), scene = (folder.path() / "s.toml").string();
  const Options o = options_of({"--paused", "--ghosts", "--theme", "light", "--color-map", "cividis",
                                "--overlay", "compact", "--ui-scale", "1.5", "--no-vsync", "--full-screen",
                                "--overlay-csv", csv, "--save-scene", scene});
  EXPECT_TRUE(o.paused && o.ghosts && o.full_screen && !o.vsync);
  EXPECT_EQ(o.theme + o.color_map + o.overlay, "lightcividiscompact");
  EXPECT_EQ(o.ui_scale, 1.5);
  EXPECT_EQ(o.overlay_csv, csv);
  EXPECT_EQ(o.save_scene, scene);
  const Options none = options_of({});
  EXPECT_TRUE(!none.paused && !none.ghosts && !none.full_screen && none.vsync);
  EXPECT_EQ(none.theme + none.color_map + none.overlay, "darkviridisfull");
}

TEST(Options, FlagsOfTheShowAreChecked) {
  TemporaryFolder folder;
  const std::string there = folder.write("there.toml", "x").string();
  EXPECT_TRUE(contains(refusal({"--theme", "ligt"}), "the nearest is light; one of dark, light"));
  EXPECT_TRUE(contains(refusal({"--color-map", "jet"}), "one of viridis, cividis, grey"));
  EXPECT_TRUE(contains(refusal({"--overlay", "on"}), "one of full, compact, off"));
  for (const char* bad : {"0.5", "9", "nan", "x", ""})
    EXPECT_TRUE(contains(refusal({"--ui-scale", bad}), "give a number from 0.75 to 3")) << bad;
  EXPECT_TRUE(contains(refusal({"--paused", "--headless"}), "leave out one of the two"));
  EXPECT_TRUE(contains(refusal({"--save-scene", there}), "is there already"));
  EXPECT_TRUE(contains(refusal({"--save-scene", "/tmp/x.txt"}), "must end in .toml"));
}

// A scene's own length is that of a headless run only.
TEST(Options, SecondsCountAsGivenOnlyWhenTyped) {
  EXPECT_FALSE(options_of({"--scene", "gas"}).seconds_given);
  EXPECT_TRUE(options_of({"--scene", "gas", "--seconds", "2"}).seconds_given);
  EXPECT_TRUE(options_of({"--set", " run.seconds = 2"}).seconds_given);
  EXPECT_FALSE(options_of({"--set", "run.seed=2"}).seconds_given);
}

TEST(Options, SceneThenSetThenFlags) {
  const Options options = options_of({"-p", "7", "--ball-vx", "4", "--set", "air.num_parcels=5", "--set",
                                      " ball.vy_mps = 6 ", "--set", "ball.vx_mps=5", "--scene", "gas"});
  EXPECT_EQ(options.settings.name, "gas");
  EXPECT_EQ(options.settings.restitution, 1.0);
  EXPECT_EQ(options.settings.num_parcels, 7);
  EXPECT_EQ(options.settings.ball_vx_mps, 4.0);
  EXPECT_EQ(options.settings.ball_vy_mps, 6.0);
}

TEST(Options, NumParcels) {
  EXPECT_EQ(options_of({"-p", "1e6"}).settings.num_parcels, 1000000);
  EXPECT_EQ(options_of({"-p1"}).settings.num_parcels, 1);
  EXPECT_EQ(options_of({"-p", "200000000"}).settings.num_parcels, 200000000);
  EXPECT_EQ(
      refusal({"-p", "0"}),
      "-p: '0' is out of range; air.num_parcels takes a whole number from 1 to 200000000; to fly without "
      "parcels use --set air.kind=vacuum");
  for (const char* text : {"-5", "1000000000000", "200000001", "1e300", "1e999"}) {
    EXPECT_TRUE(contains(refusal({"-p", text}), std::string("-p: '") + text + "' is out of range")) << text;
  }
  for (const char* text : {"nan", "inf", "-inf"}) {
    EXPECT_TRUE(contains(refusal({"-p", text}), "is not a finite number")) << text;
  }
  EXPECT_TRUE(contains(refusal({"-p", "2.5"}), "'2.5' is not a whole number"));
  EXPECT_TRUE(contains(refusal({"-p", ""}), "'' is not a number"));
  EXPECT_TRUE(contains(refusal({"-p", "--cuda"}), "'--cuda' is not a number"));
  EXPECT_TRUE(contains(refusal({"-p"}), "-p: 1 required N missing"));
  EXPECT_TRUE(contains(refusal({"-p", "1", "-p", "2"}), "-p: "));
  EXPECT_EQ(options_of({"--set", "air.kind=vacuum"}).settings.air, Air::vacuum);
}

TEST(Options, BadSettingsAreNamed) {
  EXPECT_TRUE(
      contains(refusal({"--ball-vx", "nan"}), "--ball-vx: 'nan' is not a finite number; ball.vx_mps takes"));
  EXPECT_TRUE(
      contains(refusal({"--method", "implse"}), "--method: 'implse' is unknown, the nearest is impulse"));
  EXPECT_TRUE(contains(refusal({"--method", ""}), "--method: '' is unknown"));
  EXPECT_TRUE(contains(refusal({"--threads", "1025"}), "--threads: '1025' is out of range"));
  EXPECT_TRUE(contains(refusal({"--scene", "cort"}), "--scene: 'cort' is not a scene; the nearest is court"));
  EXPECT_TRUE(contains(refusal({"--scene", ""}), "--scene: '' is not a scene"));
  EXPECT_TRUE(
      contains(refusal({"--set", "air.restitution=2"}), "--set air.restitution: '2' is out of range"));
  EXPECT_TRUE(contains(refusal({"--set", "air.restituton=1"}), "the nearest is air.restitution"));
  EXPECT_TRUE(contains(refusal({"--set", "air.restitution"}), "has no '='"));
  EXPECT_TRUE(contains(refusal({"--draw-target", "hots"}), "'hots' is unknown, the nearest is host"));
}

TEST(Options, Size) {
  for (const char* text :
       {"", "800", "800x", "x600", "0x600", "800x-600", "800x600x2", "16385x100", "8e2x600", "800 x600"}) {
    EXPECT_TRUE(contains(refusal({"--size", text}), "is not a size; give WIDTHxHEIGHT")) << text;
  }
  EXPECT_EQ(options_of({"--size", "16X16384"}).height_px, 16384);
}

TEST(Options, UnknownWords) {
  EXPECT_TRUE(contains(refusal({"--headles"}),
                       "'--headles' is not an option of 'pickleflight run'; the nearest is "
                       "--headless"));
  EXPECT_TRUE(contains(refusal({"--headles=1"}), "the nearest is --headless"));
  EXPECT_TRUE(contains(refusal({"bnech"}), "the nearest command is bench"));
  EXPECT_TRUE(contains(refusal({"-t", "bench"}), "'bench' must come first"));
  EXPECT_TRUE(contains(refusal({"bench", "--record", "a.mp4"}), "--record: goes with --frames N"));
  EXPECT_TRUE(contains(refusal({"--steps", "3"}), "'--steps' is not an option of 'pickleflight run'"));
  EXPECT_TRUE(contains(refusal({"--headless=foo"}), "--headless"));
}

TEST(Options, BenchOfWholeFrames) {
  const Options plain = options_of({"bench", "--frames", "5", "--panel"});
  EXPECT_EQ(plain.bench_frames, 5);
  EXPECT_TRUE(plain.bench_panel);
  EXPECT_EQ(plain.width_px, 1280);
  EXPECT_TRUE(plain.record.empty());
  const Options film =
      options_of({"bench", "--frames", "5", "--record", "/dev/null", "--record-time", "real"});
  EXPECT_EQ(film.record, "/dev/null");
  EXPECT_TRUE(film.record_real_time);
  EXPECT_EQ(film.width_px, 1920);
  EXPECT_EQ(film.height_px, 1080);
  EXPECT_EQ(options_of({"bench", "--frames", "5", "--record", "/dev/null", "--size", "64x48"}).width_px, 64);
  EXPECT_TRUE(contains(refusal({"bench", "--panel"}), "--panel: goes with --frames N"));
  EXPECT_TRUE(contains(refusal({"bench", "--frames", "5", "--record-time", "real"}), "goes with --record"));
  EXPECT_TRUE(contains(refusal({"bench", "--frames", "5", "--record", "a.avi"}), ".mp4 or .mkv or .rgb"));
  EXPECT_TRUE(contains(refusal({"--record", "/dev/null"}), "--record: '/dev/null' has the wrong ending"));
  EXPECT_TRUE(contains(refusal({"bench", "--sweep", "--record", "/dev/null"}), "--sweep: chooses"));
}

TEST(Options, ForceLetsSpringTakeAnyStep) {
  EXPECT_FALSE(options_of({}).settings.allow_unstable);
  EXPECT_TRUE(options_of({"--force", "--set", "run.allow_unstable=false"}).settings.allow_unstable);
  EXPECT_TRUE(options_of({"bench", "--force"}).settings.allow_unstable);
}

TEST(Options, Bench) {
  const Options options = options_of({"bench", "--steps", "7", "--warmup", "0", "--repeats", "3", "-p", "100",
                                      "--cuda", "--set", "run.seed=4"});
  EXPECT_EQ(options.command, Command::bench);
  EXPECT_EQ(options.settings.name, "gas");
  EXPECT_EQ(options.bench_steps, 7);
  EXPECT_EQ(options.bench_warmup, 0);
  EXPECT_EQ(options.bench_repeats, 3);
  EXPECT_EQ(options.settings.num_parcels, 100);
  EXPECT_EQ(options.settings.seed, 4);
  EXPECT_TRUE(options.cuda);
  EXPECT_EQ(options_of({"bench", "--scene", "court"}).settings.name, "court");
  EXPECT_TRUE(contains(refusal({"bench", "--steps", "0"}),
                       "--steps: '0' cannot be used; give a whole number from 1"));
  EXPECT_TRUE(contains(refusal({"bench", "--warmup", "-1"}), "--warmup: '-1'"));
  EXPECT_TRUE(contains(refusal({"bench", "--repeats", "99999999999"}), "--repeats: "));
}

TEST(Options, Lab) {
  const Options options = options_of({"lab", "terms", "--quick", "--out", "here", "--resume"});
  EXPECT_EQ(options.command, Command::lab);
  EXPECT_EQ(options.lab.study, "terms");
  EXPECT_EQ(options.lab.out, "here");
  EXPECT_TRUE(options.lab.quick && options.lab.resume && !options.lab.force);
  EXPECT_EQ(options_of({"lab", "terms"}).lab.out, "lab-terms");
  EXPECT_TRUE(contains(refusal({"lab", "terms", "--resume", "--force"}), "contradicts"));
  EXPECT_TRUE(contains(refusal({"lab", "validate", "--cuda"}), "has no CUDA series"));
  EXPECT_TRUE(contains(refusal({"lab", "validate", "--resume"}), "give --out DIR"));
  EXPECT_TRUE(
      contains(refusal({"lab", "validate", "--out", "here", "--json", "x.json"}), "has the JSON in it"));
  EXPECT_TRUE(contains(refusal({"lab", "plot"}), "takes the folder"));
  EXPECT_TRUE(contains(refusal({"lab", "plot", "here", "--quick"}), "nothing else"));
  EXPECT_TRUE(contains(refusal({"lab", "terms", "here"}), "'here'"));
  EXPECT_EQ(options_of({"lab", "plot", "here"}).lab.out, "here");
  EXPECT_EQ(options_of({"lab", "validate", "--out", "here"}).lab.out, "here");
  EXPECT_TRUE(options_of({"lab", "validate"}).lab.out.empty());
  EXPECT_TRUE(contains(refusal({"lab", "terms", "--json", "x.json"}), "goes with validate"));
  EXPECT_TRUE(contains(refusal({"lab", "stability", "--scene", "court"}), "goes with terms"));
}

TEST(Options, AccuracyChoosesMethodAndStepItself) {
  const Options options = options_of({"--accuracy", "2%", "--of", "drag", "-p", "500"});
  EXPECT_EQ(options.accuracy.error, 0.02);
  EXPECT_EQ(options.accuracy.of, "drag");
  EXPECT_TRUE(options.accuracy.keep_parcels);
  EXPECT_EQ(options_of({}).accuracy.error, 0.0);
  EXPECT_TRUE(contains(refusal({"--accuracy", "1%", "--method", "exact"}), "leave out --method"));
  EXPECT_TRUE(contains(refusal({"--accuracy", "1%", "--dt", "0.1"}), "leave out --dt"));
  EXPECT_TRUE(contains(refusal({"--accuracy", "much"}), "not an accuracy"));
  EXPECT_TRUE(contains(refusal({"--accuracy", "1%", "--of", "presure"}), "nearest is pressure"));
  EXPECT_TRUE(contains(refusal({"--of", "rate"}), "goes with --accuracy"));
}

TEST(Options, Scenes) { EXPECT_EQ(options_of({"scenes"}).command, Command::scenes); }

TEST(Options, LabValidate) {
  const Options options = options_of({"lab", "validate", "--quick"});
  EXPECT_EQ(options.command, Command::lab);
  EXPECT_EQ(options.lab.study, "validate");
  EXPECT_TRUE(options.lab.quick);
  EXPECT_FALSE(options_of({"lab", "validate"}).lab.quick);
  EXPECT_TRUE(contains(refusal({"lab"}), "no study is named"));
  EXPECT_TRUE(contains(refusal({"lab", "valid"}),
                       "'valid' is no study, the nearest is validate; the studies are: validate"));
}

TEST(Options, VersionAndHelpAreText) {
  const std::string version =
      std::string("pickleflight ") + PF_VERSION + " (CUDA backend: " + (PF_HAVE_CUDA ? "yes" : "no") + ")\n";
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--version"}, {"-t", "--version"}, {"bench", "--version"}}) {
    const ParseResult result = parse(words);
    EXPECT_FALSE(result.options.has_value());
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.text, version);
  }
  const ParseResult help = parse({"--help"});
  EXPECT_FALSE(help.options.has_value());
  EXPECT_EQ(help.exit_code, 0);
  for (const char* part :
       {"bench", "scenes", "-p N", "1 to 200000000", "default 20000 on a CPU", "--ball-spin OMEGA",
        "[rad/s]; -100000 to 100000; default 25", "impulse, spring, exact; default impulse",
        "air.restitution = 0.9 (0 to 1)", "--cuda-no-fallback", "--record FILE", "--size WxH"}) {
    EXPECT_TRUE(contains(help.text, part)) << part;
  }
  EXPECT_TRUE(contains(parse({"bench", "--help"}).text, "--repeats N"));
  EXPECT_FALSE(contains(parse({"bench", "--help"}).text, "--headless"));
}

TEST(Options, OutputFilesAreCheckedAndLeftAlone) {
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

TEST(Options, UnwritableOutputIsRefused) {
  TemporaryFolder folder;
  const std::string missing = (folder.path() / "no" / "a.mp4").string();
  const std::string message = refusal({"--record", missing});
  EXPECT_TRUE(contains(message, "--record: '" + missing + "' cannot be written: the folder '")) << message;
  EXPECT_TRUE(contains(message, "choose a file in a folder that exists and is writable")) << message;
  EXPECT_TRUE(contains(refusal({"--report", folder.path().string()}), "it is a folder"));
  EXPECT_TRUE(contains(refusal({"--report", "/proc/pf_report.json"}),
                       "--report: '/proc/pf_report.json' cannot be written"));
  EXPECT_TRUE(contains(refusal({"bench", "--json", "/proc/pf.json"}), "--json: "));
  EXPECT_TRUE(contains(refusal({"--report", ""}), "cannot be written"));
}

TEST(Options, EndingsAreChecked) {
  EXPECT_TRUE(contains(refusal({"--record", "/tmp/a.avi"}),
                       "--record: '/tmp/a.avi' has the wrong ending; the file must "
                       "end in .mp4 or .mkv"));
  EXPECT_TRUE(contains(refusal({"--record", ""}), "wrong ending"));
  EXPECT_TRUE(contains(refusal({"--picture", "/tmp/a.jpg"}), "must end in .png"));
}

TEST(Options, RecordingIsChosen) {
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

TEST(Options, AStillHasATimeAndAFile) {
  const Options options = options_of({"--still", "0.25", "a.png"});
  EXPECT_EQ(options.still_s, 0.25);
  EXPECT_TRUE(options.headless);
  for (const char* time : {"x", "nan", "inf", "1e7", "0.1s", ""})
    EXPECT_TRUE(contains(refusal({"--still", time, "a.png"}), "is not a time; give seconds")) << time;
  EXPECT_TRUE(contains(refusal({"--still", "1", "a.jpg"}), "must end in .png"));
}

TEST(Options, ALogIsAWholeFlight) {
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
                                               {"--still", "0", "a.png"}}) {
    std::vector<std::string> words = {"run", log};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_TRUE(contains(refusal(words), "a log has its own scene and settings")) << more[0];
  }
  EXPECT_TRUE(contains(refusal({"run", (folder.path() / "none.toml").string()}), "cannot be read as a log"));
}

}  // namespace
}  // namespace pf
