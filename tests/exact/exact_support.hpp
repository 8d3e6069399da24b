// Shared by the tests of method `exact`.
#pragma once

#include <cstdlib>

#include "lab/theory.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

inline Settings exact(Settings s) {
  s.method = Method::exact;
  return s;
}

// Factor of the tests' length from PF_TEST_SCALE in the environment; 1, as in CI, if it is not set.
inline int test_scale() {
  const char* text = std::getenv("PF_TEST_SCALE");
  return text == nullptr ? 1 : std::max(1, std::atoi(text));
}

}  // namespace pf::test
