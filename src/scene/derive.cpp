#include "scene/derive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "model/ball.hpp"
#include "model/kinetic_theory.hpp"
#include "model/spring.hpp"

namespace pf {
namespace {

// std::hypot is avoided: its rounding differs between C libraries.
double norm(double x, double y) { return std::sqrt(x * x + y * y); }

double inertia_factor(Inertia inertia) {
  switch (inertia) {
    case Inertia::ring:
      return 1.0;
    case Inertia::disk:
      return 0.5;
    default:
      return 2.0 / 3.0;
  }
}

ParcelConstants derive_parcels(const Settings& s, double area_m2) {
  ParcelConstants parcels;
  if (s.air != Air::parcels) return parcels;
  const double n = static_cast<double>(s.num_parcels);
  parcels.num = static_cast<std::uint32_t>(s.num_parcels);
  parcels.radius_m =
      s.parcel_radius_m > 0.0 ? s.parcel_radius_m : std::sqrt(s.area_fraction * area_m2 / (kPi * n));
  parcels.mass_kg = s.parcel_mass_kg > 0.0 ? s.parcel_mass_kg : s.areal_density_kg_m2 * area_m2 / n;
  parcels.speed_mps = s.parcel_speed_mps;
  parcels.restitution = s.restitution;
  parcels.impulse_scale = s.impulse_scale;
  parcels.contacts = s.contacts;
  return parcels;
}

// Mass per area of the air: of so many parcels, or of air without them.
double areal_density_of(const Settings& s, double area_m2) {
  if (!(s.parcel_mass_kg > 0.0) || s.num_parcels <= 0) return s.areal_density_kg_m2;
  return static_cast<double>(s.num_parcels) * s.parcel_mass_kg / area_m2;
}

BallConstants derive_ball(const Settings& s, double area_m2) {
  BallConstants ball;
  ball.exists = s.ball_present;
  ball.held = s.ball_held;
  ball.mass_kg = s.ball_mass_kg;
  ball.radius_m = s.ball_radius_m;
  ball.inertia_kg_m2 = inertia_factor(s.inertia) * s.ball_mass_kg * s.ball_radius_m * s.ball_radius_m;
  ball.friction = s.friction;
  ball.magnus_per_rad = s.magnus ? s.k_magnus / s.ball_mass_kg : 0.0;
  if (s.air == Air::drag) {
    ball.drag_per_m = areal_density_of(s, area_m2) * cold_drag_coefficient(s.restitution, s.friction) *
                      s.ball_radius_m / s.ball_mass_kg;
  }
  return ball;
}

double hot_speed_mps(const Settings& s) { return s.hot_radius_m > 0.0 ? s.hot_speed_mps : 0.0; }

// Speed that the fastest of the parcels have on average.
double air_speed_mps(const Settings& s) {
  return std::max({s.parcel_speed_mps, norm(s.flow_x_mps, s.flow_y_mps), hot_speed_mps(s)});
}

// Without parcels the box is as large as with them, if that is known.
Vec2d world_size_m(const Settings& s) {
  const bool is_known = s.parcel_radius_m > 0.0 && s.num_parcels > 0;
  if (!s.box_follows_parcels || (s.air != Air::parcels && !is_known)) return {s.width_m, s.height_m};
  if (s.parcel_radius_m <= 0.0) {
    throw UserError(
        "world.box_follows_parcels = true needs air.parcel_radius_m > 0: the box follows from N, radius and "
        "area fraction; set it, for example --set air.parcel_radius_m=0.5");
  }
  const double area =
      static_cast<double>(s.num_parcels) * kPi * s.parcel_radius_m * s.parcel_radius_m / s.area_fraction;
  const double scale = std::sqrt(area / (s.width_m * s.height_m));
  return {s.width_m * scale, s.height_m * scale};
}

void check_world_size(Vec2d size) {
  if (std::min(size.x, size.y) >= 1e-4 * std::max(size.x, size.y)) return;
  throw UserError(fmt::format(
      "world: {:g} m x {:g} m is too narrow; sides may differ by a factor of at most 10^4", size.x, size.y));
}

void check_parcel_size(const Settings& s, const Physics& physics, Vec2d size) {
  if (physics.parcels.num == 0) return;
  const double diameter = 2.0 * physics.parcels.radius_m;
  const double smaller = std::min(size.x, size.y);
  if (diameter > 0.5 * smaller) {
    const bool by_radius = s.parcel_radius_m > 0.0;
    throw UserError(fmt::format(
        "air: {}{} {} {:g} m wide, more than half the world's smaller side ({:g} m); {}",
        physics.parcels.num == 1 ? "1 parcel" : fmt::format("{} parcels", physics.parcels.num),
        by_radius ? "" : fmt::format(" at area fraction {:g}", s.area_fraction),
        physics.parcels.num == 1 ? "is" : "are", diameter, smaller,
        by_radius ? "lower air.parcel_radius_m" : "raise air.num_parcels or lower air.area_fraction"));
  }
  if (diameter < physics.world.unit_m) {  // a contact's position would not be resolved
    throw UserError(
        fmt::format("air: parcels of radius {:g} m are smaller than positions can resolve in a world of "
                    "{:g} m x {:g} m; the radius must be at least {:g} m; raise air.parcel_radius_m or "
                    "air.area_fraction, or lower air.num_parcels",
                    physics.parcels.radius_m, size.x, size.y, 0.5 * physics.world.unit_m));
  }
  const double fraction = area_fraction_of(physics);
  if (fraction > 0.7001) {
    throw UserError(
        fmt::format("air: parcels of radius {:g} m fill {:.3f} of the world; at most 0.7 can be "
                    "spawned; lower air.parcel_radius_m or air.num_parcels",
                    physics.parcels.radius_m, fraction));
  }
}

void check_ball_size(const Settings& s, const Physics& physics, Vec2d size) {
  if (!physics.ball.exists) return;
  const double margin = physics.world.boundary == Boundary::walls ? s.ball_radius_m : 0.0;
  if (std::fabs(s.ball_x_m) > 0.5 * size.x - margin || std::fabs(s.ball_y_m) > 0.5 * size.y - margin) {
    throw UserError(
        fmt::format("ball: starts at ({:g}, {:g}) m, outside the world of {:g} m x {:g} m{}; change "
                    "ball.x_m and ball.y_m",
                    s.ball_x_m, s.ball_y_m, size.x, size.y, margin > 0.0 ? " less its radius" : ""));
  }
  if (2.0 * s.ball_radius_m > std::min(size.x, size.y)) {
    throw UserError(
        fmt::format("ball: radius {:g} m does not fit the world of {:g} m x {:g} m; lower ball.radius_m",
                    s.ball_radius_m, size.x, size.y));
  }
}

// Speed of a typical fast parcel: a few thermal speeds, or that after a hit by the ball.
double fastest_expected_mps(const Settings& s, const Physics& physics, const BallState& ball) {
  const double thermal =
      2.5 * std::max(s.parcel_speed_mps, hot_speed_mps(s)) + norm(s.flow_x_mps, s.flow_y_mps);
  if (!physics.ball.exists) return thermal;
  const double thrown = 2.0 * norm(ball.velocity_mps.x, ball.velocity_mps.y) +
                        std::fabs(ball.spin_radps) * physics.ball.radius_m + s.parcel_speed_mps;
  return std::max(thermal, thrown);
}

// Checks a given step. A chosen step resolves the contact.
void check_spring(const Settings& s) {
  const bool is_set = s.dt_s > 0.0 && s.spring_contact_s > 0.0;
  if (s.method != Method::spring || s.air != Air::parcels || !s.contacts || !is_set || s.allow_unstable)
    return;
  const double limit_s = spring_step_limit_s(spring_contact_rates(s.restitution, s.spring_contact_s));
  if (s.dt_s <= limit_s) return;
  throw UserError(fmt::format(
      "run.dt_s: {:g} s is beyond the stability bound of method spring, {:.4g} s (2/omega_0, less its "
      "damping, of a contact of {:g} s at restitution {:g}): contacts would blow up; give a shorter "
      "run.dt_s or a longer run.spring_contact_s, or force it: --force, run.allow_unstable = true",
      s.dt_s, limit_s, s.spring_contact_s, s.restitution));
}

// In a periodic world, `exact` considers nearest images only.
void check_exact(const Settings& s, const Physics& physics) {
  if (s.method != Method::exact || s.boundary != Boundary::periodic || physics.parcels.num == 0) return;
  const double radius_m = physics.parcels.radius_m;
  const double contact_m =
      (physics.ball.exists ? std::max(physics.ball.radius_m, radius_m) : radius_m) + radius_m;
  const Vec2d size = size_m(physics.world);
  const double smaller_m = std::min(size.x, size.y);
  if (smaller_m > 2.05 * contact_m) return;
  throw UserError(
      fmt::format("run.method: exact needs a periodic world wider than 2.05 contact distances, {:.3g} m; it "
                  "is {:.3g} m wide; use more or smaller parcels, or world.boundary = walls",
                  2.05 * contact_m, smaller_m));
}

}  // namespace

Physics derive_physics(const Settings& s) {
  if (s.air == Air::parcels && s.num_parcels < 1) {
    throw UserError(
        "air.num_parcels: 0 parcels; at least 1 is needed, or fly without: --set air.kind=vacuum");
  }
  const Vec2d size = world_size_m(s);
  Physics physics;
  physics.world = make_world(size.x, size.y, s.boundary);
  physics.parcels = derive_parcels(s, size.x * size.y);
  physics.ball = derive_ball(s, size.x * size.y);
  physics.seed = static_cast<std::uint64_t>(s.seed);
  const double ball_mps =
      s.ball_present ? norm(s.ball_vx_mps, s.ball_vy_mps) + std::fabs(s.ball_spin_radps) * s.ball_radius_m
                     : 0.0;
  physics.reference_speed_mps = std::max({air_speed_mps(s), ball_mps, 1e-6});
  check_spring(s);
  check_exact(s, physics);
  const Vec2d rounded_size = size_m(physics.world);
  check_world_size(rounded_size);
  check_parcel_size(s, physics, rounded_size);
  check_ball_size(s, physics, rounded_size);
  return physics;
}

bool radius_sets_density(const Settings& s) { return s.parcel_radius_m > 0.0 && !s.box_follows_parcels; }

BallState initial_ball(const Settings& s) {
  return {{s.ball_x_m, s.ball_y_m}, {s.ball_vx_mps, s.ball_vy_mps}, s.ball_spin_radps, 0.0};
}

bool has_left(const Physics& physics, const BallState& ball) {
  if (!physics.ball.exists || physics.world.boundary != Boundary::open) return false;
  const World& world = physics.world;
  const double radius = physics.ball.radius_m;
  return std::fabs(ball.position_m.x) > world.half.x * world.unit_m + radius ||
         std::fabs(ball.position_m.y) > world.half.y * world.unit_m + radius;
}

namespace {

constexpr double kStepsPerContact = 20.0;

// Longest step that displacement_per_step, `exact` and a contact of `spring` allow.
double max_step_s(const Settings& s, const Physics& physics, const BallState& ball, double rate_per_s) {
  constexpr double kCollisionsPerStep = 0.1;
  constexpr double kForever_s = 1e30;
  if (physics.parcels.num == 0) return kForever_s;
  const double fastest = fastest_expected_mps(s, physics, ball);
  double by_displacement =
      fastest > 0.0 ? s.displacement_per_step * 2.0 * physics.parcels.radius_m / fastest : kForever_s;
  if (s.method == Method::spring && s.spring_contact_s > 0.0)
    by_displacement = std::min(by_displacement, s.spring_contact_s / kStepsPerContact);
  if (s.method != Method::exact || !s.contacts) return by_displacement;
  const double rate =
      rate_per_s > 0.0
          ? rate_per_s
          : enskog_rate_per_s(area_fraction_of(physics), physics.parcels.speed_mps, physics.parcels.radius_m);
  return rate > 0.0 ? std::min(by_displacement, kCollisionsPerStep / rate) : by_displacement;
}

}  // namespace

std::int64_t resolve_num_parcels(const Settings& settings, const std::string& backend_name) {
  if (settings.air != Air::parcels) return 0;
  if (settings.num_parcels > 0) return settings.num_parcels;
  return backend_name == "cuda" ? settings.num_parcels_gpu : settings.num_parcels_cpu;
}

FramePlan plan_frame(const Settings& s, const Physics& physics, const BallState& ball,
                     double collision_rate_per_s) {
  const double frame_s = s.time_scale / s.frame_rate_hz;
  const double limit = static_cast<double>(s.substeps > 0 ? s.substeps : s.max_substeps);
  FramePlan plan;
  if (s.dt_s > 0.0) {
    plan.dt_s = s.dt_s;
    const double wanted = s.substeps > 0 ? limit : std::round(frame_s / s.dt_s);
    plan.num_steps = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, limit));
  } else {
    const double max_s = std::min(frame_s, max_step_s(s, physics, ball, collision_rate_per_s));
    const double wanted = s.substeps > 0 ? limit : std::ceil(frame_s / max_s);
    plan.num_steps = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, limit));
    plan.dt_s = std::min(max_s, frame_s / plan.num_steps);
  }
  plan.slow_motion = plan.num_steps * plan.dt_s * s.frame_rate_hz;
  return plan;
}

double measured_rate_per_s(std::uint64_t num_collisions, std::uint32_t num_parcels, const FramePlan& plan) {
  if (num_parcels == 0) return 0.0;
  const double parcel_steps = static_cast<double>(num_parcels) * plan.num_steps;  // may exceed 32 bits
  return 2.0 * static_cast<double>(num_collisions) / (parcel_steps * plan.dt_s);
}

double displacement_of_step(const Settings& s, const Physics& physics, const BallState& ball, double dt_s) {
  if (physics.parcels.num == 0) return 0.0;
  return fastest_expected_mps(s, physics, ball) * dt_s / (2.0 * physics.parcels.radius_m);
}

double spring_contact_s(const Settings& s, double dt_s) {
  return s.spring_contact_s > 0.0 ? s.spring_contact_s : kStepsPerContact * dt_s;
}

double contact_clock_s(const Settings& s, const Physics& physics) {
  if (s.contact_clock_s > 0.0 || physics.parcels.num == 0) return s.contact_clock_s;
  if (s.restitution == 1.0) return 0.0;
  constexpr double kSlowerThanTheBall = 0.1;
  const double speed_mps = std::max(air_speed_mps(s), kSlowerThanTheBall * physics.reference_speed_mps);
  return s.contact_clock / enskog_rate_per_s(area_fraction_of(physics), speed_mps, physics.parcels.radius_m);
}

}  // namespace pf
