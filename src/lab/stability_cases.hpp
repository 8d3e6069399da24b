// Single cases of the stability study: breaking points of which theory knows the curve.
#pragma once

#include <cstdint>
#include <memory>

#include "backend/backend.hpp"

namespace pf {

struct Share {
  double value = 0.0;
  double sigma = 0.0;  // standard error
};

// Share of 20,000 isolated pairs that do not collide. A pair approaches by step_diameters per step, at a
// random offset and phase. Theory for `impulse`, which acts on the first half of the overlap only:
// missed_fraction(2 step_diameters).
Share missed_share(Method method, double step_diameters, std::unique_ptr<Backend> backend);

// Speed after one full turn of the ball in steps of theta_rad, over the starting speed: by the program's
// flight, and by explicit Euler, v += theta z x v.
double turned_speed(double theta_rad, Backend& backend);
double euler_turned_speed(double theta_rad);

// Energy after over before of elastic head-on pairs that collide by `spring` at random phases; 1 is right.
// step_over_contact: time step over contact duration.
double spring_pair_energy(double step_over_contact, std::unique_ptr<Backend> backend);

// Energy after over before of three discs: one disc of speed 1 hits two resting ones at +- theta_rad, at
// least 30 degrees; two discs hit a resting one head-on from both sides.
double fork_energy(Method method, double theta_rad, std::unique_ptr<Backend> backend);
double head_on_energy(Method method, std::unique_ptr<Backend> backend);

// A cooling gas (1,024 discs, area fraction 0.25) by the reference, for the time of `collisions` collisions
// per disc at the starting rate. The contact duration of the TC model is rate_times_clock over that rate. The
// gas has collapsed if twenty events per disc advance the time by less than a millionth. The run also ends,
// not collapsed, after 2,000 events per disc. A collision is an event of two discs.
struct Collapse {
  bool collapsed = false;
  double reached_share = 0.0;  // of the planned time
  double events_per_disc = 0.0;
};
Collapse cool_with_clock(double restitution, double rate_times_clock, double collisions);

// Distance of neighbouring positions at the far side of a square world of num discs at area fraction 0.1, in
// disc diameters: of floats, and of the program's position units.
double float_position_step(double num_parcels);
double unit_position_step(double num_parcels);

}  // namespace pf
