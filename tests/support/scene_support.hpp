// Small scenes for tests, built in code.
#pragma once

#include <memory>

#include "app/step_request.hpp"
#include "backend/backend.hpp"
#include "scene/derive.hpp"
#include "scene/settings.hpp"

namespace pf::test {

// The `gas` scene: unit diameter and mass, box by N.
inline Settings gas(std::int64_t n, double area_fraction = 0.2, Boundary boundary = Boundary::walls) {
  Settings s;
  s.name = "gas";
  s.width_m = s.height_m = 1.0;
  s.boundary = boundary;
  s.box_follows_parcels = true;
  s.num_parcels = n;
  s.area_fraction = area_fraction;
  s.parcel_radius_m = 0.5;
  s.parcel_mass_kg = 1.0;
  s.restitution = 1.0;
  s.ball_present = false;
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

// A backend with the scene spawned in it.
struct SceneRun {
  Settings settings;
  Physics physics;
  BallState ball;
  std::unique_ptr<Backend> backend;

  SceneRun(const Settings& s, std::unique_ptr<Backend> with) : settings(s), backend(std::move(with)) {
    physics = derive_physics(settings);
    ball = initial_ball(settings);
    const Spawner spawner(settings, physics, ball);
    backend->reset(physics, spawner.plan(), ball);
  }
  explicit SceneRun(const Settings& s, unsigned threads = 2) : SceneRun(s, make_cpu_backend(threads)) {}

  StepReport advance(std::uint32_t steps, double dt_s) {
    return backend->advance(step_request(settings, steps, dt_s));
  }
  StepReport advance(std::uint32_t steps) { return advance(steps, plan_frame(settings, physics, ball).dt_s); }
};

}  // namespace pf::test
