// The single cases of the stability study: where a method breaks, as a curve that theory knows.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "backend/backend.hpp"

namespace pf {

struct Share {
  double value = 0.0;
  double sigma = 0.0;  // standard error
};

// Share of 20,000 lone pairs, moving by step_diameters per step towards each other at random offsets and
// phases, that do not collide. Theory: theory::missed_fraction(2 step_diameters) for `impulse`, which acts on
// the first half of the overlap only.
Share missed_share(Method method, double step_diameters, std::unique_ptr<Backend> backend);

// Speed over start after one full turn of the ball in steps of theta_rad: as the program flies, and by
// explicit Euler, v += theta z x v.
double turned_speed(double theta_rad, Backend& backend);
double euler_turned_speed(double theta_rad);

// Mean of energy after over before of head-on pairs met by `spring` at random phases; step over contact
// duration. Elastic: 1 is right.
double spring_pair_energy(double step_over_contact, std::unique_ptr<Backend> backend);

// Energy after over before: one disc of speed 1 runs into two resting ones at +- theta_rad; two meet a
// resting one head-on. theta_rad from 30 degrees on.
double fork_energy(Method method, double theta_rad, std::unique_ptr<Backend> backend);
double head_on_energy(Method method, std::unique_ptr<Backend> backend);

// A gas that cools (1,024 discs, area fraction 0.25) by the reference, for as long as `collisions` collisions
// per disc take at the start, with the TC model's clock rate_times_clock over the rate at the start.
// Collapsed: ten events per disc
// advanced the time by less than a millionth. It also ends, not collapsed, after 1,000 events per disc.
struct Collapse {
  bool collapsed = false;
  double reached_share = 0.0;  // of the time wanted
  double events_per_disc = 0.0;
};
Collapse cool_with_clock(double restitution, double rate_times_clock, double collisions);

// Distance of neighbouring positions at the far side of a square world of num discs at area fraction 0.1, in
// disc diameters: as float, and as the position units of the program.
double float_position_step(double num_parcels);
double unit_position_step(double num_parcels);

}  // namespace pf
