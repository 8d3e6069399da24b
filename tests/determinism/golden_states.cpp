// Prints the lines of the golden hashes, with nothing but the project's own code in the program: the memory
// sanitizer takes what libraries that were built without it write for never written, so GoogleTest cannot be
// there.
#include <cstdio>

#include "support/golden_scenes.hpp"

int main() {
  for (const pf::test::GoldenScene& scene : pf::test::golden_scenes()) {
    const auto make_backend = [] { return pf::make_cpu_backend(2); };
    std::printf("%s %s\n", scene.name.c_str(), pf::test::golden_line(scene, make_backend).c_str());
  }
}
