#include "lab/gas_case.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <tuple>

#include "app/scene_run.hpp"
#include "app/step_request.hpp"
#include "lab/mean_error.hpp"
#include "lab/parallel_for.hpp"
#include "lab/theory.hpp"
#include "model/kinetic_theory.hpp"

namespace pf {
namespace {

// A block is a whole number of steps. Its duration does not depend on the step, so that runs of any step
// cover the same time.
struct BlockPlan {
  std::uint32_t num_steps;
  double dt;
};
BlockPlan plan_block(double duration, double dt) {
  const double num = std::max(1.0, std::round(duration / dt));
  return {static_cast<std::uint32_t>(num), duration / num};
}

struct Block {
  double rate;       // per parcel and time, over c
  double impulse_z;  // compressibility
  double ns;         // per disc and time
};

template <class Get>
MeanError mean_of(const std::vector<Block>& blocks, Get get) {
  std::vector<double> values;
  for (const Block& block : blocks) values.push_back(get(block));
  return mean_and_error(values);
}

Block measure_block(GasRun& run, std::uint32_t num_steps, StepTotals& totals) {
  const double n = static_cast<double>(run.physics.parcels.num);
  const double before = run.c2();
  const Clock::time_point start = Clock::now();
  const StepReport report = run.advance(num_steps);
  const double ms = milliseconds_since(start);
  const double c2 = 0.5 * (before + run.c2());
  const double duration = num_steps * run.steps.dt;
  totals += report.totals;
  return {2.0 * static_cast<double>(report.totals.num_collisions) / (n * duration * std::sqrt(c2)),
          measured_compressibility(report.totals.impulse_sum_mps, duration, n, c2, 1.0),
          1e6 * ms / (n * duration)};
}

}  // namespace

double theory_rate(double area_fraction) { return theory::collision_rate_per_s(area_fraction, 1.0, 0.5); }

Settings gas_settings(const GasCase& gas) {
  Settings s = unit_gas(gas.num_parcels, gas.area_fraction, gas.boundary);
  s.restitution = gas.restitution;
  s.seed = gas.seed;
  return s;
}

const ParcelSnapshot& equilibrated(const GasCase& gas) {
  using Key = std::tuple<std::int64_t, double, std::int64_t, Boundary>;
  static std::map<Key, ParcelSnapshot> cache;  // its references stay valid
  static std::mutex guard;
  const std::lock_guard lock(guard);
  const Key key{gas.num_parcels, gas.area_fraction, gas.seed, gas.boundary};
  const auto found = cache.find(key);
  if (found != cache.end()) return found->second;
  Settings s = gas_settings(gas);
  s.restitution = 1.0;
  s.method = Method::exact;
  SceneRun run(s, parallel_threads());
  constexpr double kCollisionsPerStep = 0.1, kCollisions = 20.0;
  const double dt = kCollisionsPerStep / theory_rate(gas.area_fraction);
  run.advance(static_cast<std::uint32_t>(kCollisions / kCollisionsPerStep), dt);
  return cache.emplace(key, run.backend->snapshot()).first->second;
}

GasRun::GasRun(const GasCase& gas, const GasSteps& with, std::unique_ptr<Backend> empty)
    : steps(with), settings(gas_settings(gas)), backend(std::move(empty)) {
  settings.method = steps.method;
  settings.dt_s = steps.dt;
  settings.spring_contact_s = steps.spring_contact;
  settings.allow_unstable = true;  // the lab measures where a method breaks
  settings.contact_clock_s = steps.contact_clock;
  physics = spawn_scene(settings, *backend).physics;
  backend->restore(equilibrated(gas));
}

StepReport GasRun::advance(std::uint32_t num_steps) {
  return backend->advance(step_request(settings, physics, num_steps, steps.dt));
}

double GasRun::c2() const {
  const double freedoms = physics.parcels.num - (settings.boundary == Boundary::periodic ? 1.0 : 0.0);
  return backend->measure().parcel_energy_j / (physics.parcels.mass_kg * freedoms);
}

nlohmann::json measure_gas(const GasCase& gas, const GasSteps& wanted, std::unique_ptr<Backend> backend) {
  const double expected_rate = theory_rate(gas.area_fraction);
  const BlockPlan block = plan_block(wanted.collisions / (kGasBlocks * expected_rate), wanted.dt);
  const std::uint32_t per_block = block.num_steps;
  GasSteps steps = wanted;
  steps.dt = block.dt;
  GasRun run(gas, steps, std::move(backend));
  if (steps.warmup > 0.0) {
    run.advance(static_cast<std::uint32_t>(std::ceil(steps.warmup / (expected_rate * steps.dt))));
  }
  const double start_c2 = run.c2();
  std::vector<Block> blocks;
  StepTotals totals;
  for (int k = 0; k < kGasBlocks; ++k) blocks.push_back(measure_block(run, per_block, totals));
  const auto best = [](const Block& a, const Block& b) { return a.ns < b.ns; };
  const MeanError rate = mean_of(blocks, [](const Block& b) { return b.rate; });
  const MeanError z = mean_of(blocks, [](const Block& b) { return b.impulse_z; });
  return {
      {"method", method_name(steps.method)},
      {"area_fraction", gas.area_fraction},
      {"restitution", gas.restitution},
      {"num_parcels", gas.num_parcels},
      {"dt", steps.dt},
      {"displacement_per_step", 2.5 * steps.dt},  // of a fast parcel, as in scene/derive.cpp
      {"duration", kGasBlocks * per_block * steps.dt},
      {"collisions", 2.0 * static_cast<double>(totals.num_collisions) / static_cast<double>(gas.num_parcels)},
      {"ns_per_disc_time", std::min_element(blocks.begin(), blocks.end(), best)->ns},
      {"rate", rate.mean},
      {"rate_sigma", rate.sigma},
      {"compressibility", z.mean},
      {"compressibility_sigma", z.sigma},
      {"energy_ratio", run.c2() / start_c2},
      {"max_overlap", totals.max_overlap_diameters},
      {"num_invalid", totals.num_invalid}};
}

}  // namespace pf
