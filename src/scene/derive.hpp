// From settings to physics: radius and mass of the parcels, the world, the terms, the time step, the lattice.
#pragma once

#include <cstdint>
#include <vector>

#include "model/spawn.hpp"
#include "scene/settings.hpp"

namespace pf {

// Checks what no single field can: that parcels fit, the ball is inside, a step of `spring` that
// is set is stable, ... Throws UserError. settings.num_parcels must be resolved (not 0) unless air is not
// parcels.
Physics derive_physics(const Settings& settings);

BallState initial_ball(const Settings& settings);

// Area fraction that the physics has: N pi r^2 / area.
double area_fraction_of(const Physics& physics);

// How one frame is cut into steps. slow_motion: simulated over wall time that comes out, at most time_scale.
struct FramePlan {
  std::uint32_t num_steps = 1;
  double dt_s = 0.0;
  double slow_motion = 0.0;
};
// collision_rate_per_s: of a parcel, as last seen; 0: not known, then Enskog's. Method `exact` takes steps of
// at most 0.1 collisions per parcel: a matter of speed, its events do not depend on the step.
FramePlan plan_frame(const Settings& settings, const Physics& physics, const BallState& ball,
                     double collision_rate_per_s = 0.0);

// What run.displacement_per_step would be for steps of dt_s: diameters that an ordinary fast parcel moves.
double displacement_of_step(const Settings& settings, const Physics& physics, const BallState& ball,
                            double dt_s);

// Contact duration of `spring` as set, or 20 steps.
double spring_contact_s(const Settings& settings, double dt_s);

// Owns the tables that a SpawnPlan points to.
class Spawner {
 public:
  // Throws UserError if the parcels do not fit without overlapping each other, the ball or the walls.
  Spawner(const Settings& settings, const Physics& physics, const BallState& ball);

  const SpawnPlan& plan() const { return plan_; }

 private:
  std::vector<std::uint64_t> row_begin_;
  std::vector<std::uint32_t> blocked_first_;
  std::vector<std::uint32_t> blocked_count_;
  SpawnPlan plan_;
};

}  // namespace pf
