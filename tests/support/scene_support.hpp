// Small scenes for tests, built in code.
#pragma once

#include "app/scene_run.hpp"
#include "app/step_request.hpp"

namespace pf::test {

// The `gas` scene: unit diameter and mass, box by N.
inline Settings gas(std::int64_t n, double area_fraction = 0.2, Boundary boundary = Boundary::walls) {
  Settings s = unit_gas(n, area_fraction, boundary);
  s.dt_s = 0.035;
  s.substeps = 1;
  return s;
}

// The `court` scene with n parcels.
inline Settings court(std::int64_t n, Boundary boundary = Boundary::open) {
  Settings s;
  s.num_parcels = n;
  s.boundary = boundary;
  return s;
}

}  // namespace pf::test
