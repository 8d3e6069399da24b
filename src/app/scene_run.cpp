#include "app/scene_run.hpp"

#include "app/step_request.hpp"

namespace pf {

Settings unit_gas(std::int64_t n, double area_fraction, Boundary boundary) {
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
  s.contact_clock = 0.0;
  s.ball_present = false;
  return s;
}

void add_resting_ball(Settings& s, double mass_kg, double radius_m) {
  s.ball_present = true;
  s.ball_mass_kg = mass_kg;
  s.ball_radius_m = radius_m;
  s.ball_x_m = s.ball_y_m = s.ball_vx_mps = s.ball_vy_mps = s.ball_spin_radps = 0.0;
  s.magnus = false;
}

SpawnedScene spawn_scene(const Settings& settings, Backend& backend) {
  const SpawnedScene scene{derive_physics(settings), initial_ball(settings)};
  const Spawner spawner(settings, scene.physics, scene.ball);
  backend.reset(scene.physics, spawner.plan(), scene.ball);
  return scene;
}

SceneRun::SceneRun(const Settings& s, std::unique_ptr<Backend> with) : settings(s), backend(std::move(with)) {
  const SpawnedScene scene = spawn_scene(settings, *backend);
  physics = scene.physics;
  ball = scene.ball;
}

StepReport SceneRun::advance(std::uint32_t steps, double dt_s) {
  return backend->advance(step_request(settings, physics, steps, dt_s));
}

StepReport SceneRun::advance(std::uint32_t steps) {
  return advance(steps, plan_frame(settings, physics, ball).dt_s);
}

}  // namespace pf
