// Derives the physics from settings: parcels, world, ball, time step, lattice of the spawned parcels.
#pragma once

#include <cstdint>
#include <vector>

#include "model/spawn.hpp"
#include "scene/settings.hpp"

namespace pf {

// Checks combinations of fields: parcels fit, the ball is inside, a given step of `spring` is stable, and so
// on. Throws UserError. settings.num_parcels: not 0 if the air is made of parcels.
Physics derive_physics(const Settings& settings);

// Returns whether the area fraction follows from the number and radius of parcels, and not from
// air.area_fraction.
bool radius_sets_density(const Settings& settings);

BallState initial_ball(const Settings& settings);

// Returns whether the ball is beyond the edge of an open world with all of its disc.
bool has_left(const Physics& physics, const BallState& ball);

// Division of a frame into steps. slow_motion: resulting simulated over wall time, at most time_scale unless
// dt_s or substeps are set.
struct FramePlan {
  std::uint32_t num_steps = 1;
  double dt_s = 0.0;
  double slow_motion = 0.0;
};
// Returns whether run.time_scale has no effect: time step and steps per frame are set.
inline bool paces_by_substeps(const Settings& settings) {
  return settings.dt_s > 0.0 && settings.substeps > 0;
}
// The setting num_parcels, or the backend's default. 0 if the air is not made of parcels.
std::int64_t resolve_num_parcels(const Settings& settings, const std::string& backend_name);
// collision_rate_per_s: last known rate of a parcel; 0: unknown, then Enskog's. Steps of method `exact` have
// at most 0.1 collisions per parcel. That affects speed alone, unless the ball flies along chords
// (docs/exact.md).
FramePlan plan_frame(const Settings& settings, const Physics& physics, const BallState& ball,
                     double collision_rate_per_s = 0.0);

// The rate of a parcel in the frame of that plan, for the next plan: each collision counts for both partners.
// 0 without parcels.
double measured_rate_per_s(std::uint64_t num_collisions, std::uint32_t num_parcels, const FramePlan& plan);

// Value of run.displacement_per_step that leads to steps of dt_s: displacement of a typical fast parcel, in
// diameters.
double displacement_of_step(const Settings& settings, const Physics& physics, const BallState& ball,
                            double dt_s);

// Contact duration of `spring`: the setting, or 20 steps if that is 0.
double spring_contact_s(const Settings& settings, double dt_s);

// Contact duration of the TC model in `exact`, from the settings: in seconds, or as a share of the mean free
// time at the start. That is the time between collisions in a gas of this area fraction whose parcels have
// their own speed, or a tenth of the ball's if that is more. 0 if nothing is lost in a collision. physics:
// from the same settings.
double contact_clock_s(const Settings& settings, const Physics& physics);

// Plans the initial positions, and owns the tables that the plan points to.
class Spawner {
 public:
  // Throws UserError if the parcels do not fit without overlap with each other, the ball or the walls.
  Spawner(const Settings& settings, const Physics& physics, const BallState& ball);
  Spawner(Spawner&&) = default;  // a copy's plan would point into the tables of the other
  Spawner& operator=(Spawner&&) = default;

  const SpawnPlan& plan() const { return plan_; }

 private:
  std::vector<std::uint64_t> row_start_;
  std::vector<std::uint32_t> blocked_first_;
  std::vector<std::uint32_t> blocked_count_;
  SpawnPlan plan_;
};

}  // namespace pf
