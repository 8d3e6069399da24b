#include <cmath>

#include "backend/backend.hpp"
#include "model/contact.hpp"
#include "model/spring.hpp"

namespace pf {
namespace {

void set_spring(StepConstants& c, double contact_s) {
  const SpringContactRates rates = spring_contact_rates(c.physics.parcels.restitution, contact_s);
  const double spring_rate_per_s2 = 0.5 * rates.omega0_squared_per_s2;  // k / m
  c.spring_mps = static_cast<float>(spring_rate_per_s2 * c.physics.world.unit_m * c.dt_s);
  c.damping_share = static_cast<float>(rates.damping_per_s * c.dt_s);
}

void set_floats(StepConstants& c) {
  c.touch_distance2 =
      static_cast<std::uint64_t>(std::fmin(std::ceil(c.contact_distance * c.contact_distance), 0x1p63));
  c.touch_distance = static_cast<float>(c.contact_distance);
  c.per_touch_distance = static_cast<float>(1.0 / c.contact_distance);
  const double advance = 0x1p-32 * c.advance_scale;
  c.advance = static_cast<float>(advance);
  c.advance_rest = static_cast<float>(advance - static_cast<double>(c.advance));
  const double velocity_step_mps = c.velocity_unit_mps * (1 << kVelocityBits);
  c.velocity_step_mps = static_cast<float>(velocity_step_mps);
  c.per_velocity_step = static_cast<float>(1.0 / velocity_step_mps);
  c.per_impulse = static_cast<float>(c.per_impulse_count);
  c.exchange = static_cast<float>(exchange_of(c.physics.parcels));
}

// Smallest power of two that is at least value. value > 0.
double next_power_of_two(double value) {
  int exponent = 0;
  const double fraction = std::frexp(value, &exponent);  // in [1/2, 1)
  return std::ldexp(1.0, fraction == 0.5 ? exponent - 1 : exponent);
}

}  // namespace

StepConstants make_step_constants(const Physics& physics, double dt_s, double spring_contact_s) {
  StepConstants c;
  c.physics = physics;
  c.dt_s = dt_s;
  const double unit_m = physics.world.unit_m;
  c.advance_scale = dt_s / unit_m * 4294967296.0;
  c.contact_distance = 2.0 * physics.parcels.radius_m / unit_m;
  c.filter_distance2 = static_cast<float>(c.contact_distance * c.contact_distance * (1.0 + 1e-5));
  c.contact_reach = static_cast<std::int32_t>(std::ceil(c.contact_distance));
  c.ball_contact_m = physics.ball.radius_m + physics.parcels.radius_m;
  const double reference = next_power_of_two(physics.reference_speed_mps);
  c.velocity_unit_mps = reference * 0x1p-40;
  c.per_impulse_unit = 1.0 / (reference * 0x1p-32);
  c.impulse_unit_kg_mps = reference * 0x1p-32 * physics.parcels.mass_kg;
  c.per_impulse_count = 1.0 / (reference * 0x1p-20);
  set_floats(c);
  const std::int32_t radius = c.contact_reach / 2;
  c.inside_x = inside_range(physics.world.boundary, physics.world.half.x, radius);
  c.inside_y = inside_range(physics.world.boundary, physics.world.half.y, radius);
  if (spring_contact_s > 0.0) set_spring(c, spring_contact_s);
  return c;
}

RunConstants make_run_constants(const Physics& physics, double contact_clock_s) {
  constexpr double kMinSeparation = 0x1p-20;  // of the reference speed
  constexpr double kUndoTicks = 0x1p14;       // in which an overlap is undone
  RunConstants run;
  static_cast<StepConstants&>(run) = make_step_constants(physics, 0.0, 0.0);
  run.ball_contact = run.ball_contact_m / physics.world.unit_m;
  TickScale& ticks = run.reference_ticks;
  ticks.tick_s = tick_seconds(physics.world, physics.reference_speed_mps);
  ticks.units_per_tick = ticks.tick_s / physics.world.unit_m;
  ticks.reference_speed_mps = physics.reference_speed_mps;
  ticks.min_separation_speed_mps = kMinSeparation * physics.reference_speed_mps;
  if (physics.parcels.restitution < 1.0)
    ticks.separation_mps_per_unit = 1.0 / (kUndoTicks * ticks.units_per_tick);
  // Longer ones cannot be counted: a contact of kAnchorPeriod ago is as good as none, docs/exact.md says so.
  const double contact_ticks = std::ceil(contact_clock_s / ticks.tick_s);
  ticks.contact_duration_ticks =
      static_cast<std::uint32_t>(std::fmin(contact_ticks, static_cast<double>(kAnchorPeriod - 1)));
  return run;
}

}  // namespace pf
