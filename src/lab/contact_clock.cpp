// Contact clock: what the contact duration of the TC model does to a gas and to a flight, and what it saves.
#include <fmt/format.h>

#include <cmath>

#include "lab/contact_clock_shifts.hpp"
#include "lab/flight_case.hpp"
#include "lab/gas_case.hpp"
#include "lab/study.hpp"
#include "model/kinetic_theory.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

using nlohmann::json;

// Contact durations, mean free times of parcels as fast as the fastest body. The others are compared with the
// first.
constexpr double kClocks[] = {0.0, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1};
constexpr double kFlightRestitutions[] = {0.9, 0.5, 0.0};

// A cooling gas, from equilibrium: collisions and energy left, of each seed.
json gas_point(double restitution, double clock, bool quick) {
  const std::int64_t num_seeds = quick ? 16 : 64;
  json runs = json::array();
  for (std::int64_t seed = 1; seed <= num_seeds; ++seed) {
    const GasCase gas{quick ? 8000 : 32000, 0.2, restitution, seed, Boundary::periodic};
    GasSteps steps{Method::exact, 0.1 / theory_rate(gas.area_fraction)};
    steps.contact_clock = clock / theory_rate(gas.area_fraction);
    steps.collisions = 20.0;
    steps.warmup = 0.0;
    const json row = measure_gas(gas, steps, make_cpu_backend(1));
    runs.push_back({row.at("collisions"), row.at("energy_ratio")});
  }
  return {{"case", "gas"},
          {"restitution", restitution},
          {"clock", clock},
          {"default_clock", Settings{}.contact_clock},
          {"runs", runs}};
}

double mean_free_time_s(const Physics& physics) {
  return 1.0 /
         enskog_rate_per_s(area_fraction_of(physics), physics.reference_speed_mps, physics.parcels.radius_m);
}

// Flights over the court: path and speed lost at the end, and collisions per parcel, of each seed.
json flight_point(double restitution, double clock, bool quick) {
  const int num_seeds = quick ? 48 : 96;
  Settings s = court_settings({quick ? 4000 : 20000, 0.1, restitution});
  s.method = Method::exact;
  s.displacement_per_step = 0.5;
  const Physics physics = derive_physics(s);
  const double default_clock = contact_clock_s(s, physics) / mean_free_time_s(physics);
  s.contact_clock = 0.0;
  s.contact_clock_s = clock * mean_free_time_s(physics);
  const double launch_mps = std::hypot(s.ball_vx_mps, s.ball_vy_mps);
  const std::unique_ptr<Backend> backend = make_cpu_backend(1);
  json runs = json::array();
  for (s.seed = 1; s.seed <= num_seeds; ++s.seed) {
    const FlightResult flight = fly_scene(s, kCourtFlight_s, *backend);
    const Vec2d moved = flight.ball.position_m - Vec2d{s.ball_x_m, s.ball_y_m};
    runs.push_back(
        {moved.x, moved.y, launch_mps - speed_of(flight.ball),
         2.0 * static_cast<double>(flight.totals.num_collisions) / static_cast<double>(s.num_parcels)});
  }
  return {{"case", "flight"},
          {"restitution", restitution},
          {"clock", clock},
          {"default_clock", default_clock},
          {"runs", runs}};
}

std::vector<LabPoint> plan_contact_clock(const LabContext& context) {
  std::vector<LabPoint> points;
  for (const double clock : kClocks) {
    points.push_back({fmt::format("gas/0.9/{:g}", clock),
                      [clock, quick = context.quick] { return gas_point(0.9, clock, quick); }});
    for (const double e : kFlightRestitutions) {
      points.push_back({fmt::format("flight/{:g}/{:g}", e, clock),
                        [e, clock, quick = context.quick] { return flight_point(e, clock, quick); }});
    }
  }
  return points;
}

}  // namespace

Study contact_clock_study() {
  return {
      "contact-clock",
      "What the contact duration changes",
      "Dots are differences from the same run without a contact duration, with standard errors; the dashed "
      "line is the default. On its left a gas differs by less than its error; at e = 0 the ball's drag still "
      "does by some tenths of a per cent.",
      plan_contact_clock,
      conclude_contact_clock,
      true};
}

}  // namespace pf
