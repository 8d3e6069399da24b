// What the tests of method `exact` share.
#pragma once

#include <cstdlib>

#include "lab/theory.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

inline Settings exact(Settings s) {
  s.method = Method::exact;
  return s;
}

// How much longer than in CI the tests are to run: PF_TEST_SCALE in the environment, 1 if not set.
inline int test_scale() {
  const char* text = std::getenv("PF_TEST_SCALE");
  return text == nullptr ? 1 : std::max(1, std::atoi(text));
}

// Collisions per parcel and second that Enskog expects.
inline double rate_per_s(const SceneRun& run) {
  return theory::collision_rate_per_s(area_fraction_of(run.physics), run.physics.parcels.speed_mps,
                                      run.physics.parcels.radius_m);
}

}  // namespace pf::test
