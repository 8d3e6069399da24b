// Validation of the gas in equilibrium: collision rate and pressure.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "app/scene_run.hpp"
#include "core/timing.hpp"
#include "lab/gas_case.hpp"
#include "lab/mean_error.hpp"
#include "lab/parallel_for.hpp"
#include "lab/theory.hpp"
#include "lab/validate.hpp"
#include "model/kinetic_theory.hpp"

namespace pf {
namespace {

struct Equilibrium {
  Mean rate_per_s;  // collisions per parcel, over c
  Mean z;           // compressibility by the virial theorem
  double seconds = 0.0;
};

struct GasLength {
  double equilibrate;  // collisions per parcel
  double num_events;   // of all runs together, after that
  int num_runs;        // in parallel, each with its own seed
  int num_blocks;      // of each run
};

struct GasBlock {
  double rate_per_s, z;
};

// A step lasts 0.1 collisions per parcel for `exact`, 0.01 for `impulse`. The temperature is K / (N - 1),
// since the total momentum is zero.
std::vector<GasBlock> measure_blocks(const Settings& settings, const GasLength& length) {
  SceneRun run(settings, 1);
  const double num = run.physics.parcels.num;
  const double rate = theory::collision_rate_per_s(settings.area_fraction, 1.0, 0.5);
  const double step_s = (settings.method == Method::exact ? 0.1 : 0.01) / rate;
  const auto steps_for = [&](double per_parcel) {
    return static_cast<std::uint32_t>(std::max(1.0, std::round(per_parcel / (rate * step_s))));
  };
  run.advance(steps_for(length.equilibrate), step_s);
  const double c2 = run.backend->measure().parcel_energy_j / (num - 1.0);
  const std::uint32_t steps =
      steps_for(2.0 * length.num_events / num / (length.num_runs * length.num_blocks));
  const double time_s = steps * step_s;
  std::vector<GasBlock> blocks;
  for (int block = 0; block < length.num_blocks; ++block) {
    const StepTotals totals = run.advance(steps, step_s).totals;
    blocks.push_back({2.0 * static_cast<double>(totals.num_collisions) / (num * time_s * std::sqrt(c2)),
                      measured_compressibility(totals.impulse_sum_mps, time_s, num, c2, 1.0)});
  }
  return blocks;
}

Equilibrium measure_equilibrium(const Settings& settings, const GasLength& length) {
  const Clock::time_point start = Clock::now();
  std::vector<std::vector<GasBlock>> runs(static_cast<std::size_t>(length.num_runs));
  parallel_for(length.num_runs, 0, [&](int k) {
    Settings s = settings;
    s.seed = k + 1;
    runs[static_cast<std::size_t>(k)] = measure_blocks(s, length);
  });
  Equilibrium result;
  for (const auto& blocks : runs) {
    for (const GasBlock& block : blocks) {
      result.rate_per_s.add(block.rate_per_s);
      result.z.add(block.z);
    }
  }
  result.seconds = milliseconds_since(start) * 1e-3;
  return result;
}

// Collisions per parcel until equilibrium: order relaxes slowly near freezing (docs/physics.md, 'Measuring
// rate and pressure').
double equilibration(double area_fraction) { return area_fraction >= 0.6 ? 500.0 : 50.0; }

GasLength gas_length(const ValidationPlan& plan, double equilibrate, double num_events) {
  return plan.quick ? GasLength{equilibrate, num_events, 2, 12} : GasLength{equilibrate, num_events, 16, 2};
}

void add_density(const ValidationPlan& plan, double eta, Method method, const RowSink& add) {
  const bool exact = method == Method::exact;
  const auto num = static_cast<std::int64_t>(plan.amount(4096, 1024));
  const double events = exact ? plan.amount(4e7, 2.5e5) : plan.amount(1e6, 1e5);
  const double equilibrate = exact ? equilibration(eta) * plan.amount(1.0, 0.5) : 10.0;
  Settings s = unit_gas(num, eta, Boundary::periodic);
  s.method = method;
  const Equilibrium gas = measure_equilibrium(s, gas_length(plan, equilibrate, events));
  ValidationRow row;
  row.method = method;
  row.judged = exact;
  row.tolerance = plan.tolerance();
  row.seconds = gas.seconds;
  row.reference = fmt::format("collision rate, eta {:.2f} (Kolafa-Rottner)", eta);
  row.expected = theory::collision_rate_per_s(eta, 1.0, 0.5);
  row.measured = gas.rate_per_s.value();
  row.sigma = gas.rate_per_s.error();
  add(row);
  row.reference = fmt::format("Z = P / n kT, eta {:.2f} (Kolafa-Rottner)", eta);
  row.expected = theory::compressibility(eta);
  row.measured = gas.z.value();
  row.sigma = gas.z.error();
  row.seconds = 0.0;
  add(row);
}

// P* = P d^2 / kT of 870 discs in a box of 29 : 30 sqrt(3) / 2, after Li et al. 2022.
void add_pressure_of_870(const ValidationPlan& plan, double eta, double expected, const RowSink& add) {
  Settings s = unit_gas(870, eta, Boundary::periodic);
  s.method = Method::exact;
  s.width_m = 29.0;
  s.height_m = 15.0 * std::sqrt(3.0);
  const Equilibrium gas = measure_equilibrium(s, gas_length(plan, 500.0, plan.amount(4e7, 3e5)));
  const double per_z = 4.0 * eta / kPi;
  ValidationRow row;
  row.reference = fmt::format("P*, eta {:.3f}, N = 870 (Li et al. 2022)", eta);
  row.expected = expected;
  row.measured = gas.z.value() * per_z;
  row.sigma = gas.z.error() * per_z;
  row.tolerance = plan.tolerance();
  row.seconds = gas.seconds;
  add(row);
}

}  // namespace

std::vector<ValidationCase> gas_cases(const ValidationPlan& plan) {
  std::vector<ValidationCase> cases;
  for (const double eta : {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65}) {
    for (const Method method : {Method::exact, Method::impulse}) {
      cases.push_back({fmt::format("density/{}/{}", method_name(method), eta),
                       [=](const RowSink& add) { add_density(plan, eta, method, add); }});
    }
  }
  cases.push_back(
      {"870 discs/0.67", [plan](const RowSink& add) { add_pressure_of_870(plan, 0.67, 7.986735, add); }});
  if (plan.quick) return cases;
  cases.push_back(
      {"870 discs/0.69", [plan](const RowSink& add) { add_pressure_of_870(plan, 0.69, 8.969476, add); }});
  return cases;
}

}  // namespace pf
