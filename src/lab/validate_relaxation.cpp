// Rungs of the ladder: how the gas forgets its first velocities, and how it cools.
#include <fmt/format.h>

#include "app/scene_run.hpp"
#include "core/timing.hpp"
#include "lab/samples.hpp"
#include "lab/theory.hpp"
#include "lab/validate.hpp"

namespace pf {
namespace {

// <v^4> / (2 <v^2>^2) - 1: 0 for a Maxwellian, -1/2 for equal speeds.
double fourth_moment_excess(Backend& backend) {
  double v2 = 0.0, v4 = 0.0;
  const ParcelSnapshot state = backend.snapshot();
  for (const Vec2f& velocity : state.velocity) {
    const double speed2 = dot(to_double(velocity), to_double(velocity));
    v2 += speed2;
    v4 += speed2 * speed2;
  }
  const auto num = static_cast<double>(state.velocity.size());
  return v4 * num / (2.0 * v2 * v2) - 1.0;
}

// Equal speeds, directions at random in opposite pairs.
void set_equal_speeds(Backend& backend, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  ParcelSnapshot state = backend.snapshot();
  const std::size_t half = state.velocity.size() / 2;
  for (std::size_t i = 0; i < half; ++i) {
    const double angle = 2.0 * kPi * uniform(random);
    state.velocity[i] = to_float({std::sqrt(2.0) * std::cos(angle), std::sqrt(2.0) * std::sin(angle)});
    state.velocity[i + half] = -state.velocity[i];
  }
  backend.restore(state);
}

// Excess after some collisions per parcel, from equal speeds, in a dilute gas: expected from a direct
// simulation Monte Carlo of the homogeneous Boltzmann equation (4e6 parcels; error 0.003, the tolerance).
void add_excess(const ValidationPlan& plan, const RowSink& add) {
  constexpr double kAfter[3] = {1.0, 2.0, 4.0};
  constexpr double kExpected[3] = {-0.369, -0.264, -0.126};
  constexpr double kNum = 20000.0;
  const Clock::time_point start = Clock::now();
  Mean found[3];
  const auto runs = static_cast<int>(plan.amount(64, 6));
  for (int seed = 1; seed <= runs; ++seed) {
    Settings s = unit_gas(static_cast<std::int64_t>(kNum), 0.01, Boundary::periodic);
    s.method = Method::exact;
    s.seed = seed;
    SceneRun run(s, plan.threads);
    set_equal_speeds(*run.backend, static_cast<std::uint64_t>(seed));
    const double step_s = 0.02 / theory::collision_rate_per_s(s.area_fraction, 1.0, 0.5);
    double collisions = 0.0;
    for (int k = 0; k < 3; ++k) {
      while (2.0 * collisions / kNum < kAfter[k])
        collisions += static_cast<double>(run.advance(1, step_s).totals.num_collisions);
      found[k].add(fourth_moment_excess(*run.backend));
    }
  }
  for (int k = 0; k < 3; ++k) {
    ValidationRow row;
    row.yardstick = fmt::format("excess a2 after {:g} collisions (Boltzmann)", kAfter[k]);
    row.relative = false;
    row.expected = kExpected[k];
    row.measured = found[k].value();
    row.sigma = found[k].error();
    row.tolerance = 0.006;
    row.seconds = k == 0 ? milliseconds_since(start) * 1e-3 : 0.0;
    add(row);
  }
}

// T / T0 after 14 initial collision times at e = 0.9, N = 200, below the 242 from which clusters form. 2 %:
// shear waves of all lengths are damped more slowly than the gas cools and come to hold more than their
// share, which Haff's law does not know of. The serial reference is 1.2 +- 0.2 % above the law as well.
void add_cooling(const ValidationPlan& plan, Method method, const RowSink& add) {
  constexpr double kEta = 0.2, kRestitution = 0.9, kNum = 200.0, kCollisionTimes = 14.0;
  const Clock::time_point start = Clock::now();
  Mean ratio;
  const auto seeds = static_cast<int>(plan.amount(1000, 256));
  for (int seed = 1; seed <= seeds; ++seed) {
    Settings s = unit_gas(static_cast<std::int64_t>(kNum), kEta, Boundary::periodic);
    s.method = method;
    s.seed = seed;
    SceneRun run(s, 1);
    run.advance(method == Method::exact ? 200 : 800, method == Method::exact ? 0.08 : 0.02);
    const double energy = run.backend->measure().parcel_energy_j;
    run.physics.parcels.restitution = kRestitution;
    run.backend->set_physics(run.physics);
    const double rate = theory::collision_rate_per_s(kEta, std::sqrt(energy / (kNum - 1.0)), 0.5);
    const double time_s = kCollisionTimes / rate;
    const std::uint32_t steps = method == Method::exact ? 140 : 600;
    run.advance(steps, time_s / steps);
    ratio.add(run.backend->measure().parcel_energy_j / energy);
  }
  ValidationRow row;
  row.method = method;
  row.judged = method == Method::exact;
  row.yardstick = "T / T0 after 14 collision times, e 0.9 (Haff)";
  row.expected = theory::cooled_fraction(kRestitution, 1.0, kCollisionTimes);
  row.measured = ratio.value();
  row.sigma = ratio.error();
  row.tolerance = 0.02;
  row.seconds = milliseconds_since(start) * 1e-3;
  add(row);
}

}  // namespace

std::vector<Rung> relaxation_rungs(const ValidationPlan& plan) {
  return {{"excess", [plan](const RowSink& add) { add_excess(plan, add); }},
          {"cooling/exact", [plan](const RowSink& add) { add_cooling(plan, Method::exact, add); }},
          {"cooling/impulse", [plan](const RowSink& add) { add_cooling(plan, Method::impulse, add); }}};
}

}  // namespace pf
