// Small scenes for tests, built in code.
#pragma once

#include "app/scene_run.hpp"
#include "app/step_request.hpp"

namespace pf::test {

// A frame's budget that is spent at once: a picture has a step, or a window of one.
constexpr double kMinBudget_ms = 1e-6;

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

// One parcel that touches the right wall, and a ball of radius 2 on the left of it, with method exact.
inline SceneRun parcel_between_wall_and_ball(Settings s, Vec2f parcel_mps, std::unique_ptr<Backend> backend) {
  s.method = Method::exact;
  s.ball_present = true;
  s.ball_radius_m = 2.0;
  s.ball_y_m = s.friction = 0.0;
  SceneRun run(s, std::move(backend));
  ParcelSnapshot parcel = run.backend->snapshot();
  const World& world = run.physics.world;
  parcel.position[0] = {world.half.x - static_cast<std::int32_t>(0.5 / world.unit_m), 0};
  parcel.velocity[0] = parcel_mps;
  run.backend->restore(parcel);
  return run;
}

// The ball is held and leaves no room: the parcel collides endlessly with both.
inline SceneRun parcel_in_a_vice(std::unique_ptr<Backend> backend) {
  Settings s = gas(1, 0.02);
  s.ball_held = true;
  s.ball_x_m = 0.9;
  return parcel_between_wall_and_ball(s, {1.0F, 0.0F}, std::move(backend));
}

// A ball of a million tons flies at the parcel, which collides endlessly in the end.
inline SceneRun parcel_before_a_press(std::unique_ptr<Backend> backend) {
  Settings s = gas(1, 0.02);
  s.ball_mass_kg = 1e9;
  s.ball_x_m = -0.5;
  s.ball_vx_mps = 1.0;
  return parcel_between_wall_and_ball(s, {}, std::move(backend));
}

}  // namespace pf::test
