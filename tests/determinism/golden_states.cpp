// Prints the lines of the golden hashes. The program contains no library such as GoogleTest: the memory sanitizer
// takes memory written by code that was built without it as uninitialised.
#include <cstdio>

#include "support/golden_scenes.hpp"

int main() {
  for (const pf::test::GoldenScene& scene : pf::test::golden_scenes()) {
    const auto make_backend = [] { return pf::make_cpu_backend(2); };
    std::printf("%s %s\n", scene.name.c_str(), pf::test::golden_line(scene, make_backend).c_str());
  }
}
