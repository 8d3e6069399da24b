// When a run's dump and checkpoints are due.
#include "data/run_files.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "data/checkpoint_file.hpp"
#include "data/random_scenes.hpp"
#include "support/losing_backend.hpp"
#include "unit/temporary_folder.hpp"

namespace pf::test {
namespace {

class RunFilesTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  DataOptions options_ = with_dump();
  Simulation simulation_{gas(40), make_cpu_backend(1)};

  DataOptions with_dump() const {
    DataOptions options;
    options.dump = folder_.path() / "a.xyz";
    return options;
  }
  void fly(RunFiles& files, int num_frames, Commands first = {}) {
    for (int frame = 0; frame < num_frames; ++frame) {
      simulation_.advance_frame(first, nullptr);
      files.follow(simulation_, {});
      first = {};
    }
  }
  // Times of the dump's frames, as text.
  std::vector<std::string> times() const {
    const std::string text = contents_of(options_.dump), key = " Time=";
    std::vector<std::string> found;
    for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
      const std::size_t start = at + key.size();
      found.push_back(text.substr(start, text.find(' ', start) - start));
    }
    return found;
  }
};

// Each scene's start is written, also if none of its frames ends an interval.
TEST_F(RunFilesTest, WritesTheStartOfEachScene) {
  options_.dump_every_s = 1e6;
  options_.checkpoint = folder_.path() / "a.state";
  options_.checkpoint_every_s = 1e6;
  RunFiles files(options_, false, nullptr);
  files.follow(simulation_, {});
  fly(files, 3);
  Commands next;
  next.restart = gas(50);
  fly(files, 3, next);
  EXPECT_EQ(simulation_.view().num_scenes, 2);
  EXPECT_EQ(files.report()["checkpoint"]["failure"], "");
  files.finish(simulation_, {});
  EXPECT_EQ(times(), (std::vector<std::string>{"0", "0"}));
  EXPECT_EQ(contents_of(options_.dump).substr(0, 3), "40\n");
  EXPECT_NE(contents_of(options_.dump).find("\n50\n"), std::string::npos);
  EXPECT_EQ(files.report()["checkpoint"]["written"], 3);  // each start, and the end
}

TEST_F(RunFilesTest, WritesTheFirstStateAfterAReset) {
  options_.dump_every_s = 1e6;
  RunFiles files(options_, false, nullptr);
  files.follow(simulation_, {});
  fly(files, 3);
  Commands back;
  back.reset = true;
  fly(files, 3, back);
  files.finish(simulation_, {});
  EXPECT_EQ(times().size(), 2U);
}

// Neither 2^63 nor the largest double is reached by counting intervals.
TEST_F(RunFilesTest, IntervalsShorterThanAFrameAreEveryFrame) {
  for (const double every_s : {1e-3, 1e-22, 5e-324}) {
    options_.dump_every_s = every_s;
    RunFiles files(options_, false, nullptr);
    files.follow(simulation_, {});
    fly(files, 6);
    files.finish(simulation_, {});
    EXPECT_EQ(times().size(), 7U) << every_s;
  }
}

// The folder of the checkpoint comes later than the first one that is due.
TEST_F(RunFilesTest, ACheckpointThatFailsKeepsNoLaterOneFromItsFile) {
  const std::filesystem::path later = folder_.path() / "later";
  options_.dump.clear();
  options_.checkpoint = later / "a.state";
  options_.checkpoint_every_s = 1e-22;
  std::vector<std::string> lines;
  RunFiles files(options_, false, [&](const std::string& line) { lines.push_back(line); });
  files.follow(simulation_, {});
  fly(files, 2);
  ASSERT_EQ(lines.size(), 1U) << "the same reason is told once";
  EXPECT_TRUE(lines[0].ends_with("the next one is tried as planned")) << lines[0];
  std::filesystem::create_directory(later);
  fly(files, 1);
  files.finish(simulation_, {});
  EXPECT_FALSE(files.failed());
  EXPECT_EQ(lines.size(), 1U);
  EXPECT_EQ(read_checkpoint(options_.checkpoint).totals.num_steps, simulation_.view().totals.num_steps);
}

TEST_F(RunFilesTest, TheLastCheckpointThatFailsIsToldAsTheEnd) {
  options_.dump.clear();
  options_.checkpoint = folder_.path() / "nowhere" / "a.state";
  std::vector<std::string> lines;
  RunFiles files(options_, false, [&](const std::string& line) { lines.push_back(line); });
  fly(files, 1);
  files.finish(simulation_, {});
  EXPECT_TRUE(files.failed());
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].find("the next one"), std::string::npos) << lines[0];
}

// Without a file of before there is nothing to keep: those of the flight that began anew are written.
TEST_F(RunFilesTest, WritesTheFirstCheckpointAfterTheDeviceFailed) {
  options_.dump.clear();
  options_.checkpoint = folder_.path() / "a.state";
  Simulation losing(gas(40), std::make_unique<LosingBackend>(LosingBackend::At::submit, 2));
  losing.set_fallback([] { return make_cpu_backend(1); });
  RunFiles files(options_, false, nullptr);
  for (int frame = 0; frame < 5; ++frame) {
    losing.advance_frame({}, nullptr);
    files.follow(losing, {});
  }
  ASSERT_EQ(losing.num_fallbacks(), 1);
  files.finish(losing, {});
  EXPECT_FALSE(files.failed());
  EXPECT_EQ(read_checkpoint(options_.checkpoint).totals.num_steps, losing.view().totals.num_steps);
}

// The flight begins anew on another backend; the file is of before.
TEST_F(RunFilesTest, KeepsTheCheckpointOfBeforeTheDeviceFailed) {
  options_.dump.clear();
  options_.checkpoint = folder_.path() / "a.state";
  options_.checkpoint_every_s = 1e-22;
  Simulation losing(gas(40), std::make_unique<LosingBackend>(LosingBackend::At::submit, 3));
  losing.set_fallback([] { return make_cpu_backend(1); });
  std::vector<std::string> lines;
  RunFiles files(options_, false, [&](const std::string& line) { lines.push_back(line); });
  std::uint64_t last = 0;
  for (int frame = 0; frame < 6; ++frame) {
    losing.advance_frame({}, nullptr);
    files.follow(losing, {});
    if (losing.num_fallbacks() == 0) last = losing.view().totals.num_steps;
  }
  files.finish(losing, {});
  ASSERT_EQ(losing.num_fallbacks(), 1);
  ASSERT_GT(last, 0U);
  EXPECT_EQ(read_checkpoint(options_.checkpoint).totals.num_steps, last);
  EXPECT_TRUE(files.failed());
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find("stays as it was before the device failed"), std::string::npos) << lines[0];
}

}  // namespace
}  // namespace pf::test
