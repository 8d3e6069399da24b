// Small scenes for tests, built in code.
#pragma once

#include "app/scene_run.hpp"
#include "app/step_request.hpp"

namespace pf::test {

// A frame's budget that is spent at once: a picture has a step, or a window of one.
constexpr double kLeastBudget_ms = 1e-6;

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

// A parcel between a wall and a held ball without room: in method exact it collides endlessly with both.
inline SceneRun parcel_in_a_vice(std::unique_ptr<Backend> backend) {
  Settings s = gas(1, 0.02);
  s.method = Method::exact;
  s.ball_present = s.ball_held = true;
  s.ball_radius_m = 2.0;
  s.ball_x_m = 0.9;
  s.ball_y_m = s.friction = 0.0;
  SceneRun run(s, std::move(backend));
  ParcelSnapshot parcel = run.backend->snapshot();
  const World& world = run.physics.world;
  parcel.position[0] = {world.half.x - static_cast<std::int32_t>(0.5 / world.unit_m), 0};
  parcel.velocity[0] = {1.0F, 0.0F};
  run.backend->restore(parcel);
  return run;
}

// A parcel at a wall, and a ball of a million tons that flies at it: between them the parcel collides
// endlessly in the end.
inline SceneRun parcel_before_a_press(std::unique_ptr<Backend> backend) {
  Settings s = gas(1, 0.02);
  s.method = Method::exact;
  s.ball_present = true;
  s.ball_radius_m = 2.0;
  s.ball_mass_kg = 1e9;
  s.ball_x_m = -0.5;
  s.ball_vx_mps = 1.0;
  s.ball_y_m = s.friction = 0.0;
  SceneRun run(s, std::move(backend));
  ParcelSnapshot parcel = run.backend->snapshot();
  const World& world = run.physics.world;
  parcel.position[0] = {world.half.x - static_cast<std::int32_t>(0.5 / world.unit_m), 0};
  parcel.velocity[0] = {};
  run.backend->restore(parcel);
  return run;
}

}  // namespace pf::test
