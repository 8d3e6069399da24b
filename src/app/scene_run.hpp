// Scenes built in code and run without a loop around them: what the lab and the tests measure on.
#pragma once

#include <memory>

#include "backend/backend.hpp"
#include "scene/derive.hpp"
#include "scene/settings.hpp"

namespace pf {

// n parcels of unit diameter, mass and speed per component, elastic, in a square made to fit; no ball.
Settings unit_gas(std::int64_t n, double area_fraction, Boundary boundary);

// A ball at rest in the middle, without Magnus term; friction stays as it is.
void add_resting_ball(Settings& settings, double mass_kg, double radius_m);

struct SpawnedScene {
  Physics physics;
  BallState ball;
};

// Throws UserError for settings that cannot run. settings.num_parcels as derive_physics wants it.
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
  StepReport advance(std::uint32_t steps);  // of the length that the scene starts with
};

}  // namespace pf
