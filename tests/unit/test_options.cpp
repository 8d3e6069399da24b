// The command line: flags of a run and its settings.
#include <gtest/gtest.h>

#include "option_support.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

TEST(Options, DefaultsRunTheCourt) {
  const Options options = options_of({});
  EXPECT_EQ(options.command, Command::run);
  EXPECT_EQ(options.settings.name, "court");
  EXPECT_FALSE(options.show_path || options.cuda || options.cuda_no_fallback || options.headless);
  EXPECT_TRUE(options.show_panel);
  EXPECT_EQ(options.draw_target, "auto");
  EXPECT_TRUE(options.record.empty() && options.report.empty() && options.picture.empty());
}

TEST(Options, AcceptsTheSeedsCommandLine) {
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

TEST(Options, FlagsReachTheirOptions) {
  const Options options = options_of(
      {"run",        "--method",      "spring", "--neighbors", "all-pairs", "--threads", "3",   "--dt",
       "0.001",      "--substeps",    "4",      "--seed",      "9",         "--seconds", "2.5", "--headless",
       "--no-panel", "--draw-target", "staged", "--size",      "800x601"});
  EXPECT_EQ(options.settings.method, Method::spring);
  EXPECT_EQ(options.settings.neighbors, Neighbors::all_pairs);
  EXPECT_EQ(options.settings.threads, 3);
  EXPECT_EQ(options.settings.dt_s, 0.001);
  EXPECT_EQ(options.settings.substeps, 4);
  EXPECT_EQ(options_of({"--time-scale", "0.5"}).settings.time_scale, 0.5);
  EXPECT_EQ(options.settings.seed, 9);
  EXPECT_EQ(options.settings.seconds, 2.5);
  EXPECT_TRUE(options.headless);
  EXPECT_FALSE(options.show_panel);
  EXPECT_EQ(options.draw_target, "staged");
  EXPECT_EQ(options.width_px, 800);
  EXPECT_EQ(options.height_px, 601);
}

TEST(Options, FlagsOfThePictureReachTheirOptions) {
  TemporaryFolder folder;
  const std::string csv = (folder.path() / "o.csv").string(), scene = (folder.path() / "s.toml").string();
  const std::string profile = (folder.path() / "p.csv").string();
  const Options o = options_of({"--paused", "--ghosts", "--theme", "light", "--color-map", "cividis",
                                "--overlay", "compact", "--ui-scale", "1.5", "--no-vsync", "--full-screen",
                                "--overlay-csv", csv, "--profile-csv", profile, "--save-scene", scene});
  EXPECT_TRUE(o.paused && o.ghosts && o.full_screen && !o.vsync);
  EXPECT_EQ(o.theme + o.color_map + o.overlay, "lightcividiscompact");
  EXPECT_EQ(o.ui_scale, 1.5);
  EXPECT_EQ(o.overlay_csv, csv);
  EXPECT_EQ(o.profile_csv, profile);
  EXPECT_EQ(o.save_scene, scene);
  const Options none = options_of({});
  EXPECT_TRUE(!none.paused && !none.ghosts && !none.full_screen && none.vsync);
  EXPECT_EQ(none.theme + none.color_map + none.overlay, "darkviridisfull");
}

TEST(Options, FlagsOfThePictureAreChecked) {
  TemporaryFolder folder;
  const std::string there = folder.write("there.toml", "x").string();
  EXPECT_TRUE(contains(refusal({"--theme", "ligt"}), "the nearest is light; one of dark, light"));
  EXPECT_TRUE(contains(refusal({"--color-map", "jet"}), "one of viridis, cividis, grey"));
  EXPECT_TRUE(contains(refusal({"--overlay", "on"}), "one of full, compact, off"));
  for (const char* bad : {"0.5", "9", "nan", "x", ""})
    EXPECT_TRUE(contains(refusal({"--ui-scale", bad}), "give a number from 0.75 to 3")) << bad;
  const std::string png = (folder.path() / "p.png").string();
  EXPECT_TRUE(
      contains(refusal({"--paused", "--headless"}), "only the space bar of a window starts a paused run"));
  EXPECT_TRUE(contains(refusal({"--paused", "--still", "0.1", png}), "only the space bar of a window"));
  EXPECT_TRUE(contains(refusal({"--headless", "--record-overlay", "off"}), "needs a picture"));
  EXPECT_EQ(refusal({"--headless", "--record-overlay", "off", "--picture", png}), "accepted");
  EXPECT_TRUE(contains(refusal({"--headless", "--scene", "bullet", "--time-scale", "0.1"}),
                       "run.time_scale: has no effect where run.dt_s and run.substeps are set"));
  EXPECT_EQ(refusal({"--headless", "--scene", "bullet", "--time-scale", "0.1", "--substeps", "0"}),
            "accepted");
  EXPECT_TRUE(contains(refusal({"--save-scene", there}), "already exists"));
  EXPECT_TRUE(contains(refusal({"--save-scene", "/tmp/x.txt"}), "must end in .toml"));
  EXPECT_TRUE(contains(refusal({"--save-scene", ""}), "must end in .toml"));
  const std::string csv = (folder.path() / "p.csv").string();
  EXPECT_TRUE(
      contains(refusal({"--headless", "--profile-csv", csv}), "--profile-csv: needs a profile; add one"));
  EXPECT_EQ(options_of({"--headless", "--profile-csv", csv, "--scene", "blast"}).profile_csv, csv);
}

TEST(Options, LengthAndFormatOfAClip) {
  const Options none = options_of({});
  EXPECT_TRUE(none.clip_s == 5 && !none.keep_clip && none.clip_format == "gif");
  const Options webp = options_of({"--clip", "12", "--clip-format", "webp"});
  EXPECT_TRUE(webp.clip_s == 12 && webp.keep_clip && webp.clip_format == "webp");
  for (const char* bad : {"0", "16", "2.5", "x"})
    EXPECT_TRUE(contains(refusal({"--clip", bad}), "--clip")) << refusal({"--clip", bad});
  EXPECT_TRUE(contains(refusal({"--clip-format", "mp4"}), "one of gif, webp"));
}

// The length in a scene applies to headless runs only.
TEST(Options, SecondsOfASceneDoNotCountAsGiven) {
  EXPECT_FALSE(options_of({"--scene", "gas"}).seconds_given);
  EXPECT_TRUE(options_of({"--scene", "gas", "--seconds", "2"}).seconds_given);
  EXPECT_TRUE(options_of({"--set", " run.seconds = 2"}).seconds_given);
  EXPECT_FALSE(options_of({"--set", "run.seed=2"}).seconds_given);
}

TEST(Options, SetAndFlagsOverrideTheScene) {
  const Options options =
      options_of({"-p", "7", "--ball-vx", "4", "--set", " ball.vy_mps = 6 ", "--scene", "tunnel"});
  EXPECT_EQ(options.settings.name, "tunnel");
  EXPECT_EQ(options.settings.num_parcels, 7);
  EXPECT_EQ(options.settings.ball_vx_mps, 4.0);
  EXPECT_EQ(options.settings.ball_vy_mps, 6.0);
  EXPECT_EQ(refusal({"-p", "7", "--set", "air.num_parcels=5"}),
            "air.num_parcels: is given twice, --set air.num_parcels and -p; leave out one of them");
}

TEST(Options, NumParcels) {
  EXPECT_EQ(options_of({"-p", "1e6"}).settings.num_parcels, 1000000);
  EXPECT_EQ(options_of({"-p1"}).settings.num_parcels, 1);
  EXPECT_EQ(options_of({"-p", "1000000000"}).settings.num_parcels, 1000000000);
  EXPECT_EQ(refusal({"-p", "0"}),
            "-p: '0' is out of range; air.num_parcels takes a whole number from 1 to 1 billion; for a flight "
            "without parcels use --set air.kind=vacuum");
  for (const char* text : {"-5", "1000000000000", "1000000001", "1e300", "1e999"}) {
    EXPECT_TRUE(contains(refusal({"-p", text}), std::string("-p: '") + text + "' is out of range")) << text;
  }
  for (const char* text : {"nan", "inf", "-inf"}) {
    EXPECT_TRUE(contains(refusal({"-p", text}), "is not a finite number")) << text;
  }
  EXPECT_TRUE(contains(refusal({"-p", "2.5"}), "'2.5' is not a whole number"));
  EXPECT_TRUE(contains(refusal({"-p", ""}), "'' is not a number"));
  EXPECT_TRUE(contains(refusal({"-p", "--cuda"}), "'--cuda' is not a number"));
  EXPECT_TRUE(contains(refusal({"-p"}), "-p: 1 required N missing"));
  EXPECT_TRUE(contains(refusal({"--still", "0.25"}), "--still: takes 2 values, and may be given once"));
  EXPECT_TRUE(
      contains(refusal({"--ball-vx", "1", "--ball-vx", "2"}), "--ball-vx: takes 1 value, and may be"));
  EXPECT_TRUE(contains(refusal({"-p", "1", "-p", "2"}), "-p: "));
  EXPECT_EQ(options_of({"--set", "air.kind=vacuum"}).settings.air, Air::vacuum);
}

TEST(Options, RejectsBadSettings) {
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
  EXPECT_TRUE(contains(refusal({"--seed", "9007199254740993"}), "'9007199254740993' is out of range"));
  EXPECT_TRUE(contains(refusal({"--set", "air.restituton=1"}), "the nearest is air.restitution"));
  EXPECT_TRUE(contains(refusal({"--set", "air.restitution"}), "has no '='"));
  EXPECT_TRUE(contains(refusal({"--draw-target", "hots"}), "'hots' is unknown, the nearest is host"));
  EXPECT_TRUE(contains(refusal({"--domain-link", "direkt"}), "'direkt' is unknown, the nearest is direct"));
}

TEST(Options, Size) {
  for (const char* text :
       {"", "800", "800x", "x600", "0x600", "800x-600", "800x600x2", "16385x100", "8e2x600", "800 x600"}) {
    EXPECT_TRUE(contains(refusal({"--size", text}), "is not a size; give WIDTHxHEIGHT")) << text;
  }
  EXPECT_EQ(options_of({"--size", "16X16384"}).height_px, 16384);
}

TEST(Options, RejectsUnknownArguments) {
  EXPECT_TRUE(contains(refusal({"--headles"}),
                       "'--headles' is not an option of 'pickleflight run'; the nearest is "
                       "--headless"));
  EXPECT_TRUE(contains(refusal({"--headles=1"}), "the nearest is --headless"));
  EXPECT_TRUE(contains(refusal({"bnech"}), "the nearest command is bench"));
  EXPECT_TRUE(contains(refusal({"-t", "bench"}), "'bench' must come first"));
  EXPECT_TRUE(contains(refusal({"bench", "--record", "a.mp4"}), "--record: needs --frames N"));
  EXPECT_TRUE(contains(refusal({"--steps", "3"}), "'--steps' is not an option of 'pickleflight run'"));
  EXPECT_TRUE(contains(refusal({"--headless=foo"}), "--headless"));
}

TEST(Options, ForceAllowsAnyStepOfSpring) {
  EXPECT_FALSE(options_of({}).settings.allow_unstable);
  EXPECT_TRUE(options_of({"--force"}).settings.allow_unstable);
  EXPECT_EQ(
      refusal({"--force", "--set", "run.allow_unstable=false"}),
      "run.allow_unstable: is given twice, --set run.allow_unstable and --force; leave out one of them");
  EXPECT_TRUE(options_of({"bench", "--force"}).settings.allow_unstable);
}

}  // namespace
}  // namespace pf
