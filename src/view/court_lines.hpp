// The lines of a pickleball court [m], as shaders/court.frag draws them (docs/physics.md, 'Court and ball').
#pragma once

#include <cmath>

namespace pf::court {

constexpr double kFoot_m = 0.3048;
constexpr double kHalfLength_m = 22.0 * kFoot_m;
constexpr double kHalfWidth_m = 10.0 * kFoot_m;
constexpr double kZone_m = 7.0 * kFoot_m;
constexpr double kHalfLine_m = 0.0254;  // lines are 2 inches wide
constexpr double kHalfPosts_m = 11.0 * kFoot_m;

// A world of about this size has the floor of a court.
inline bool fits(double width_m, double height_m) {
  return std::fabs(width_m - 2.0 * kHalfLength_m) < 0.3 && std::fabs(height_m - 2.0 * kHalfWidth_m) < 0.2;
}

}  // namespace pf::court
