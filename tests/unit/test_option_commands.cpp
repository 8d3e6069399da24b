// The command line: other commands, --accuracy, help.
#include <gtest/gtest.h>

#include "option_support.hpp"

namespace pf {
namespace {

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
  EXPECT_TRUE(contains(refusal({"bench", "--panel"}), "--panel: needs --frames N"));
  EXPECT_TRUE(contains(refusal({"bench", "--frames", "5", "--record-time", "real"}), "needs --record"));
  EXPECT_TRUE(contains(refusal({"bench", "--frames", "5", "--record", "a.avi"}), ".mp4 or .mkv or .rgb"));
  EXPECT_TRUE(contains(refusal({"--record", "/dev/null"}), "--record: '/dev/null' has the wrong ending"));
  EXPECT_TRUE(contains(refusal({"bench", "--sweep", "--record", "/dev/null"}), "--sweep: chooses"));
}

TEST(Options, BenchRefusesWhatHasNoEffect) {
  for (const char* flag : {"--steps", "--warmup", "--repeats", "--seconds"})
    EXPECT_TRUE(contains(refusal({"bench", "--frames", "3", flag, "2"}), "--frames: times so many frames"))
        << flag;
  EXPECT_TRUE(contains(refusal({"bench", "--frames", "3", "--set", "run.seconds=2"}), "leave out --steps"));
  for (const char* mode : {"--flight", "--force"}) {  // --force: of the steps alone
    EXPECT_TRUE(contains(refusal({"bench", mode, "--size", "64x48"}), "--size: needs --frames N")) << mode;
    EXPECT_TRUE(contains(refusal({"bench", mode, "--draw-target", "auto"}), "--draw-target: needs --frames"))
        << mode;
  }
  EXPECT_TRUE(contains(refusal({"bench", "--seconds", "2"}), "--seconds: needs --flight"));
  EXPECT_EQ(options_of({"bench", "--flight", "--seconds", "2"}).settings.seconds, 2.0);
  EXPECT_TRUE(contains(refusal({"bench", "--sweep", "--cuda"}), "--sweep: chooses"));
  EXPECT_TRUE(options_of({"bench", "--sweep", "--cuda-no-fallback"}).sweep);
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
      contains(refusal({"lab", "validate", "--out", "here", "--json", "x.json"}), "contains the JSON"));
  EXPECT_TRUE(contains(refusal({"lab", "plot"}), "takes only the folder"));
  EXPECT_TRUE(contains(refusal({"lab", "plot", "here", "--quick"}), "takes only the folder"));
  EXPECT_TRUE(contains(refusal({"lab", "terms", "here"}), "'here'"));
  EXPECT_EQ(options_of({"lab", "plot", "here"}).lab.out, "here");
  EXPECT_EQ(options_of({"lab", "validate", "--out", "here"}).lab.out, "here");
  EXPECT_TRUE(options_of({"lab", "validate"}).lab.out.empty());
  EXPECT_TRUE(contains(refusal({"lab", "terms", "--json", "x.json"}), "needs validate"));
  EXPECT_TRUE(contains(refusal({"lab", "stability", "--scene", "court"}), "needs terms"));
}

TEST(Options, AccuracyExcludesMethodAndStep) {
  const Options options = options_of({"--accuracy", "2%", "--of", "drag", "-p", "500"});
  EXPECT_EQ(options.accuracy.error, 0.02);
  EXPECT_EQ(options.accuracy.of, "drag");
  EXPECT_TRUE(options.accuracy.keep_parcels);
  EXPECT_EQ(options_of({}).accuracy.error, 0.0);
  EXPECT_TRUE(contains(refusal({"--accuracy", "1%", "--method", "exact"}), "leave out --method"));
  EXPECT_TRUE(contains(refusal({"--accuracy", "1%", "--dt", "0.1"}), "leave out --dt"));
  EXPECT_TRUE(
      contains(refusal({"--accuracy", "1%", "--set", "run.spring_contact_s=0.001"}), "leave out --set"));
  for (const std::string set :
       {"run.method=spring", "run.dt_s = 0.1", " run.substeps=9", "run.displacement_per_step=0.1"}) {
    const std::string message = refusal({"--accuracy", "1%", "--set", set});
    EXPECT_TRUE(contains(message, "itself; leave out --set run.")) << message;
  }
  EXPECT_TRUE(options_of({"--accuracy", "1%", "--set", "air.num_parcels=500"}).accuracy.keep_parcels);
  EXPECT_FALSE(options_of({"--accuracy", "1%", "--set", "air.restitution=1"}).accuracy.keep_parcels);
  EXPECT_TRUE(contains(refusal({"--accuracy", "much"}), "not an accuracy"));
  EXPECT_TRUE(contains(refusal({"--accuracy", "1%", "--of", "presure"}), "nearest is pressure"));
  EXPECT_TRUE(contains(refusal({"--of", "rate"}), "needs --accuracy"));
}

TEST(Options, Scenes) { EXPECT_EQ(options_of({"scenes"}).command, Command::scenes); }

TEST(Options, LabValidate) {
  const Options options = options_of({"lab", "validate", "--quick"});
  EXPECT_EQ(options.command, Command::lab);
  EXPECT_EQ(options.lab.study, "validate");
  EXPECT_TRUE(options.lab.quick);
  EXPECT_FALSE(options_of({"lab", "validate"}).lab.quick);
  EXPECT_TRUE(contains(refusal({"lab"}), "the study is missing"));
  EXPECT_TRUE(contains(refusal({"lab", "valid"}),
                       "'valid' is not a study, the nearest is validate; the studies are: validate"));
}

TEST(Options, VersionAndHelpAreText) {
  const std::string version = std::string("pickleflight ") + PF_VERSION +
                              " (CUDA backend: " + (PF_HAVE_CUDA ? "yes" : "no") +
                              ", HDF5: " + (PF_HAVE_HDF5 ? "yes" : "no") +
                              ", MPI: " + (PF_HAVE_MPI ? "yes" : "no") + ", NCCL: " + PF_NCCL_VERSION + ")\n";
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
       {"bench", "scenes", "-p N", "1 to 1 billion", "default 20000 on a CPU", "--ball-spin OMEGA",
        "[rad/s]; -100000 to 100000; default 25", "impulse, spring, exact; default impulse",
        "air.restitution = 0.9 (0 to 1)", "--cuda-no-fallback", "--record FILE", "--size WxH"}) {
    EXPECT_TRUE(contains(help.text, part)) << part;
  }
  EXPECT_TRUE(contains(parse({"bench", "--help"}).text, "--repeats N"));
  EXPECT_FALSE(contains(parse({"bench", "--help"}).text, "--headless"));
}

}  // namespace
}  // namespace pf
