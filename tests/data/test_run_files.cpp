// When a run's dump and checkpoints are due.
#include "data/run_files.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "data/random_scenes.hpp"
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

}  // namespace
}  // namespace pf::test
