// Validation of the ball: force of a free stream of parcels on it, and its share of the energy in
// equilibrium.
#include <fmt/format.h>

#include <vector>

#include "app/scene_run.hpp"
#include "core/timing.hpp"
#include "lab/free_stream.hpp"
#include "lab/gas_case.hpp"
#include "lab/mean_error.hpp"
#include "lab/parallel_for.hpp"
#include "lab/samples.hpp"
#include "lab/theory.hpp"
#include "lab/validate.hpp"
#include "model/ball.hpp"
#include "model/free_flow.hpp"

namespace pf {
namespace {

constexpr double kContact = 0.1;        // R + r
constexpr double kParcelRadius = 1e-4;  // does not matter: parcels do not collide

struct Force {
  Mean hits_per_s, drag_n, transverse_n, torque_n_m;
  double density = 0.0;  // parcels per area, of mass 1
  double seconds = 0.0;  // wall clock
};

Settings stream_settings(const FreeStream& stream, Method method, std::int64_t num) {
  Settings s = free_stream_settings(stream, 1.0, kContact - kParcelRadius, num);
  s.parcel_radius_m = kParcelRadius;
  s.method = method;
  return s;
}

// Places parcels uniformly outside the ball, so that the flow onto the ball is stationary from the start.
void start_stream(SceneRun& run, const FreeStream& stream, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  ParcelSnapshot state = run.backend->snapshot();
  for (std::size_t i = 0; i < state.position.size(); ++i) {
    Vec2d at;
    do {
      at = {uniform(random) - 0.5, uniform(random) - 0.5};
    } while (dot(at, at) < kContact * kContact);
    const double speed = stream.thermal_mps * std::sqrt(-2.0 * std::log(1.0 - uniform(random)));
    const double angle = 2.0 * kPi * uniform(random);
    state.position[i] = to_units(run.physics.world, at);
    state.velocity[i] = to_float({stream.speed_mps + speed * std::cos(angle), speed * std::sin(angle)});
  }
  run.backend->restore(state);
}

// Each run ends before a reflected parcel can cross the periodic edge and return; the bound assumes a speed
// that hardly any parcel has. A million parcels give 35,000 hits or more.
Force measure_force(const FreeStream& stream, Method method, const ValidationPlan& plan) {
  const Clock::time_point start = Clock::now();
  const auto num = static_cast<std::int64_t>(plan.amount(1'000'000, 100'000));
  const auto runs = static_cast<int>(plan.amount(96, 16));
  const double end_s = (1.0 - 2.0 * kContact) / (2.0 * stream.speed_mps + 5.0 * stream.thermal_mps);
  const std::uint32_t steps = method == Method::exact ? 12 : 48;
  std::vector<StepTotals> totals(static_cast<std::size_t>(runs));
  parallel_for(runs, 0, [&](int k) {
    SceneRun run(stream_settings(stream, method, num), 1);
    start_stream(run, stream, stream.first_seed + static_cast<std::uint64_t>(k));
    totals[static_cast<std::size_t>(k)] = run.advance(steps, end_s / steps).totals;
  });
  Force force;
  force.density = static_cast<double>(num) / (1.0 - kPi * kContact * kContact);
  for (const StepTotals& run : totals) {
    force.hits_per_s.add(static_cast<double>(run.num_ball_hits) / end_s);
    force.drag_n.add(run.ball_impulse_kg_mps.x / end_s);
    force.transverse_n.add(run.ball_impulse_kg_mps.y / end_s);
    force.torque_n_m.add(run.ball_torque_impulse_kg_m2ps / end_s);
  }
  force.seconds = milliseconds_since(start) * 1e-3;
  return force;
}

ValidationRow stream_row(const ValidationPlan& plan, std::string reference, Method method,
                         const Force& force) {
  ValidationRow row;
  row.reference = std::move(reference);
  row.method = method;
  row.judged = method == Method::exact;
  row.tolerance = plan.tolerance();
  row.seconds = force.seconds;
  return row;
}

// Adds the row with the measured mean over `scale`.
void add_measured(ValidationRow row, double expected, const Mean& measured, double scale,
                  const RowSink& add) {
  row.expected = expected;
  row.measured = measured.value() / scale;
  row.sigma = measured.error() / scale;
  add(row);
}

// Force at a drag coefficient of 1: rho V^2 R_c.
double drag_scale(const Force& force, const FreeStream& stream) {
  return drag_force_n(1.0, force.density, stream.speed_mps, kContact);
}

void add_smooth(const ValidationPlan& plan, Method method, double speed_ratio, const RowSink& add) {
  const FreeStream stream = {.speed_mps = speed_ratio * std::sqrt(2.0)};
  const Force force = measure_force(stream, method, plan);
  add_measured(stream_row(plan, fmt::format("hits on the ball per s, S {:g}", speed_ratio), method, force),
               theory::hits_per_s(kContact, force.density, stream.speed_mps, speed_ratio), force.hits_per_s,
               1.0, add);
  ValidationRow drag = stream_row(plan, fmt::format("drag coefficient, S {:g}", speed_ratio), method, force);
  drag.seconds = 0.0;
  add_measured(drag, theory::drag_specular(speed_ratio), force.drag_n, drag_scale(force, stream), add);
}

void add_restitution(const ValidationPlan& plan, const RowSink& add) {
  const FreeStream stream = {.speed_mps = 2.0 * std::sqrt(2.0),
                             .restitution = 0.6,
                             .first_seed = 1001};  // others than those of the elastic drag
  const Force force = measure_force(stream, Method::exact, plan);
  add_measured(stream_row(plan, "drag over elastic drag, (1 + e) / 2, e 0.6, S 2", Method::exact, force), 0.8,
               force.drag_n, drag_scale(force, stream) * theory::drag_specular(2.0), add);
}

void add_friction(const ValidationPlan& plan, const RowSink& add) {
  const FreeStream stream = {.thermal_mps = 0.0, .restitution = 0.8, .friction = 0.3};
  const Force force = measure_force(stream, Method::exact, plan);
  add_measured(stream_row(plan, "drag coefficient, cold, e 0.8, friction 0.3", Method::exact, force),
               cold_drag_coefficient(stream.restitution, stream.friction), force.drag_n,
               drag_scale(force, stream), add);
}

// Friction exceeds the need of every hit: all of them stick.
void add_spin(const ValidationPlan& plan, const RowSink& add) {
  const FreeStream stream = {.speed_mps = 0.5 * std::sqrt(2.0), .friction = 1e9, .spin_radps = 20.0};
  const Force force = measure_force(stream, Method::exact, plan);
  const double radius = kContact - kParcelRadius;
  const double hits = theory::hits_per_s(kContact, force.density, stream.speed_mps, 0.5);
  add_measured(stream_row(plan, "torque, rough ball, S 0.5", Method::exact, force),
               theory::spin_torque_n_m(1.0, stream.spin_radps, radius, hits), force.torque_n_m, 1.0, add);
  ValidationRow across = stream_row(plan, "transverse force, rough ball, S 0.5", Method::exact, force);
  across.seconds = 0.0;
  // The stream flows along +x, so the ball moves through it along -x.
  const double force_n =
      theory::transverse_force_n(1.0, force.density, kContact, radius, stream.spin_radps, -stream.speed_mps);
  add_measured(across, force_n, force.transverse_n, 1.0, add);
}

// Without friction a spinning ball feels exactly no torque, and no transverse force.
void add_null(const ValidationPlan& plan, const RowSink& add) {
  const FreeStream stream = {.speed_mps = 2.0 * std::sqrt(2.0), .spin_radps = 20.0};
  const Force force = measure_force(stream, Method::exact, plan);
  ValidationRow row;
  row.reference = "torque without friction";
  row.relative = false;
  row.measured = force.torque_n_m.value();
  row.seconds = force.seconds;
  add(row);
  row.reference = "transverse force over drag without friction";
  row.measured = force.transverse_n.value() / force.drag_n.value();
  row.sigma = force.transverse_n.error() / force.drag_n.value();
  row.seconds = 0.0;
  add(row);
}

struct BallEnergy {
  double mean_j = 0.0;  // over the run
  double kT_j = 0.0;    // of ball and parcels together
};

constexpr double kLightNum = 80.0, kLightMass = 20.0;  // parcels, and parcel masses of the ball

BallEnergy measure_ball_energy(int seed, int num_samples) {
  Settings s = unit_gas(static_cast<std::int64_t>(kLightNum), 0.2, Boundary::periodic);
  s.method = Method::exact;
  s.seed = seed;
  add_resting_ball(s, kLightMass, 1.5);
  s.friction = 0.0;
  SceneRun run(s, 1);
  run.advance(500, 0.1);
  Mean energy;
  for (int k = 0; k < num_samples; ++k) {
    const Vec2d v = run.advance(5, 0.1).ball.velocity_mps;
    energy.add(0.5 * kLightMass * dot(v, v));
  }
  return {energy.value(), run.backend->measure().energy_j() / kLightNum};
}

// A smooth ball of 20 parcel masses holds kT (1 - m_b / M). M: mass of ball and parcels; total momentum zero.
void add_equipartition(const ValidationPlan& plan, const RowSink& add) {
  const Clock::time_point start = Clock::now();
  const auto runs = static_cast<int>(plan.amount(64, 16));
  const auto samples = static_cast<int>(plan.amount(8000, 6000));
  std::vector<BallEnergy> energies(static_cast<std::size_t>(runs));
  parallel_for(runs, 0,
               [&](int k) { energies[static_cast<std::size_t>(k)] = measure_ball_energy(k + 1, samples); });
  Mean share;
  for (const BallEnergy& run : energies) share.add(run.mean_j / run.kT_j);
  ValidationRow row;
  row.reference = "energy of a ball of 20 parcel masses, over kT";
  row.expected = 1.0 - kLightMass / (kLightMass + kLightNum);
  row.measured = share.value();
  row.sigma = share.error();
  row.tolerance = 0.02;
  row.seconds = milliseconds_since(start) * 1e-3;
  add(row);
}

}  // namespace

std::vector<ValidationCase> ball_cases(const ValidationPlan& plan) {
  std::vector<ValidationCase> cases;
  for (const double speed_ratio : {0.5, 2.0, 5.0}) {
    for (const Method method : {Method::exact, Method::impulse}) {
      cases.push_back({fmt::format("ball/{}/{}", method_name(method), speed_ratio),
                       [=](const RowSink& add) { add_smooth(plan, method, speed_ratio, add); }});
    }
  }
  cases.push_back({"ball/restitution", [plan](const RowSink& add) { add_restitution(plan, add); }});
  cases.push_back({"ball/friction", [plan](const RowSink& add) { add_friction(plan, add); }});
  cases.push_back({"ball/spin", [plan](const RowSink& add) { add_spin(plan, add); }});
  cases.push_back({"ball/no friction", [plan](const RowSink& add) { add_null(plan, add); }});
  cases.push_back({"ball/energy", [plan](const RowSink& add) { add_equipartition(plan, add); }});
  return cases;
}

}  // namespace pf
