// Scenes built in code and run without the simulation loop, for the lab and the tests.
#pragma once

#include <memory>

#include "backend/backend.hpp"
#include "scene/derive.hpp"
#include "scene/settings.hpp"

namespace pf {

// n elastic parcels of unit diameter, mass and speed per component, in a square of the given area fraction,
// without a ball and without a contact duration, also where the caller takes the restitution below 1.
Settings unit_gas(std::int64_t n, double area_fraction, Boundary boundary);

// Adds a ball at rest in the middle, without Magnus term. Keeps the friction.
void add_resting_ball(Settings& settings, double mass_kg, double radius_m);

struct SpawnedScene {
  Physics physics;
  BallState ball;
};

// Throws UserError for settings that cannot run. settings.num_parcels: see derive_physics().
SpawnedScene spawn_scene(const Settings& settings, Backend& backend);

// A backend with the scene spawned in it.
struct SceneRun {
  Settings settings;
  Physics physics;
  BallState ball;  // at the start
  std::unique_ptr<Backend> backend;

  SceneRun(const Settings& s, std::unique_ptr<Backend> with);
  explicit SceneRun(const Settings& s, unsigned threads = 2) : SceneRun(s, make_cpu_backend(threads)) {}

  StepReport advance(std::uint32_t steps, double dt_s);
  StepReport advance(std::uint32_t steps);  // with the initial step length of the scene
};

}  // namespace pf
