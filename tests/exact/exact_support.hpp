// Shared by the tests of method `exact`.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "lab/theory.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

constexpr auto kOpen = Boundary::open;
constexpr auto kPeriodic = Boundary::periodic;
constexpr auto kWalls = Boundary::walls;

inline Settings exact(Settings s) {
  s.method = Method::exact;
  return s;
}

// Factor of the tests' length from PF_TEST_SCALE in the environment; 1, as in CI, if it is not set.
inline int test_scale() {
  const char* text = std::getenv("PF_TEST_SCALE");
  return text == nullptr ? 1 : std::max(1, std::atoi(text));
}

inline Settings with_restitution(Settings s, double e) {
  s.restitution = e;
  return s;
}

inline Settings with_clock(Settings s, double clock_s) {
  s.contact_clock_s = clock_s;
  return s;
}

// Rounding velocities to float makes the energy a random walk over two velocities an event. Per component the
// error is 2.4e-8 of it (rms, 2^-23 / sqrt(12) on average over a factor of two), so 5.9e-8 m c^2 per velocity
// of a Maxwellian gas. The bound is four standard deviations.
inline double energy_bound_j(double num_events) { return 4.0 * 5.9e-8 * std::sqrt(2.0 * num_events); }

}  // namespace pf::test
