// The CPU backend against the golden hashes. To write new ones, run in the build folder:
//   PF_WRITE_GOLDEN_HASHES=../../tests/determinism/golden_hashes.txt tests/determinism_tests
//     --gtest_filter='GoldenHashes.*'
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

#include "support/golden_hashes.hpp"

namespace pf::test {
namespace {

TEST(GoldenHashes, AreThoseOfTheFile) {
  const MakeBackend make_backend = [] { return make_cpu_backend(1); };
  if (const char* path = std::getenv("PF_WRITE_GOLDEN_HASHES"); path != nullptr) {
    write_golden_hashes(path, make_backend);
    GTEST_SKIP() << "written to " << path << ", not compared";
  }
  expect_golden_hashes(make_backend);
}

// A fault could hide in a scene without events.
TEST(GoldenHashes, AreOfScenesInWhichSomethingHappens) {
  const std::map<std::string, std::string> lines = read_golden_hashes();
  std::set<std::string> different;
  for (const GoldenScene& scene : golden_scenes()) {
    const auto line = lines.find(scene.name);
    ASSERT_NE(line, lines.end()) << scene.name;
    EXPECT_TRUE(different.insert(line->second).second) << scene.name;
    std::istringstream words(line->second);
    std::string state, events;
    std::uint64_t num_collisions = 0, num_ball_hits = 0;
    words >> state >> events >> num_collisions >> num_ball_hits;
    const Settings& s = scene.settings;
    const bool parcels = s.air == Air::parcels;
    EXPECT_EQ(num_collisions > 0, parcels && s.contacts) << scene.name;
    EXPECT_EQ(num_ball_hits > 0, parcels && s.ball_present) << scene.name;
    EXPECT_EQ(events != "0000000000000000", parcels && s.method == Method::exact) << scene.name;
  }
}

}  // namespace
}  // namespace pf::test
