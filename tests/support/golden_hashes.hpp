// Golden hashes of the golden scenes, one line each, in tests/determinism/golden_hashes.txt. They must be
// equal for every compiler, optimisation and backend. PF_GOLDEN_HASHES: path of the file.
#pragma once

#include <gtest/gtest.h>

#include <exception>
#include <fstream>
#include <map>
#include <sstream>

#include "support/golden_scenes.hpp"

namespace pf::test {

inline constexpr const char* kGoldenHeader =
    "# State hash, event hash, pair collisions and ball hits of each scene of "
    "tests/support/golden_scenes.hpp.\n"
    "# They are equal for every compiler, every optimisation and every backend. After an intended change, "
    "write\n"
    "# new ones in the build folder and check the difference:\n"
    "#   PF_WRITE_GOLDEN_HASHES=../../tests/determinism/golden_hashes.txt tests/determinism_tests "
    "--gtest_filter='GoldenHashes.*'\n";

// Lines of the file by scene.
inline std::map<std::string, std::string> read_golden_hashes() {
  std::ifstream file(PF_GOLDEN_HASHES);
  EXPECT_TRUE(file) << "cannot read " << PF_GOLDEN_HASHES;
  std::map<std::string, std::string> lines;
  for (std::string line; std::getline(file, line);) {
    const std::size_t blank = line.find(' ');
    if (line.empty() || line[0] == '#' || blank == std::string::npos) continue;
    lines[line.substr(0, blank)] = line.substr(blank + 1);
  }
  return lines;
}

inline void write_golden_hashes(const std::string& path, const MakeBackend& make_backend) {
  std::ofstream file(path);
  file << kGoldenHeader;
  for (const GoldenScene& scene : golden_scenes())
    file << scene.name << ' ' << golden_line(scene, make_backend) << '\n';
  file.close();
  EXPECT_TRUE(file) << "cannot write " << path;
}

inline void expect_golden_hashes(const MakeBackend& make_backend) {
  std::map<std::string, std::string> expected = read_golden_hashes();
  for (const GoldenScene& scene : golden_scenes()) {
    try {
      EXPECT_EQ(golden_line(scene, make_backend), expected[scene.name]) << scene.name;
    } catch (const std::exception& error) {
      ADD_FAILURE() << scene.name << ": " << error.what();
    }
    expected.erase(scene.name);
  }
  for (const auto& line : expected)
    ADD_FAILURE() << line.first << " is in the file, but is not a golden scene";
}

}  // namespace pf::test
