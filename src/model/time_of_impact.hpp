// When two discs in straight motion touch. Host and device code.
#pragma once

#include "core/vec2.hpp"

namespace pf {

// First time in [0, dt] at which |offset + velocity t| falls to distance, or a negative number. A touching or
// overlapping pair collides at time 0 if and only if it approaches.
PF_HD inline double time_of_impact(Vec2d offset, Vec2d velocity, double distance, double dt) {
  const double b = dot(offset, velocity);
  if (!(b < 0.0)) return -1.0;
  const double gap2 = dot(offset, offset) - distance * distance;
  if (gap2 <= 0.0) return 0.0;
  const double v2 = dot(velocity, velocity);
  const double moment = cross(offset, velocity);
  const double discriminant = distance * distance * v2 - moment * moment;
  if (discriminant < 0.0) return -1.0;
  const double t = gap2 / (-b + sqrt(discriminant));
  return t <= dt ? t : -1.0;
}

}  // namespace pf
