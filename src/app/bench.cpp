#include "app/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/report.hpp"
#include "app/simulation.hpp"
#include "app/step_request.hpp"
#include "core/error.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

// Far beyond every cache.
constexpr std::size_t kCopyBytes = 256ULL << 20U;

struct Spread {
  double median, min, max;
};

Spread spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values[values.size() / 2], values.front(), values.back()};
}

// Wall-clock milliseconds of one request, for backends that report their phases late.
double timed_advance(Backend& backend, const StepRequest& request, StepReport& report) {
  const Clock::time_point start = Clock::now();
  report = backend.advance(request);
  return milliseconds_since(start);
}

}  // namespace

void run_bench(const Options& options, Backend& backend) {
  Settings settings = options.settings;
  settings.num_parcels = resolve_num_parcels(settings, backend.name());
  const Physics physics = derive_physics(settings);
  if (physics.parcels.num == 0) throw UserError("bench: air.kind is not parcels, there is nothing to time");
  const BallState ball = initial_ball(settings);
  const Spawner spawner(settings, physics, ball);
  backend.reset(physics, spawner.plan(), ball);

  StepRequest request = step_request(settings, 1, plan_frame(settings, physics, ball).dt_s);
  StepReport report;
  request.num_steps = static_cast<std::uint32_t>(std::max(1, options.bench_warmup));
  timed_advance(backend, request, report);

  RunRecord record(settings, physics, backend.measure(), backend.device());
  record.start_clock();
  std::vector<double> ns_per_step;
  request.num_steps = static_cast<std::uint32_t>(options.bench_steps);
  for (int repeat = 0; repeat < options.bench_repeats; ++repeat) {
    const double ms = timed_advance(backend, request, report);
    ns_per_step.push_back(ms * 1e6 / (static_cast<double>(request.num_steps) * physics.parcels.num));
    PhaseTimes per_step = report.times;
    for (double& phase : per_step.ms) phase /= request.num_steps;
    record.add_frame(per_step, report.totals, request.dt_s);
  }
  const Spread spread = spread_of(ns_per_step);
  nlohmann::json json = record.finish(settings, physics, backend, report.ball, 0.0);
  json["ns_per_particle_step"] = spread.median;
  json["particle_steps_per_s"] = 1e9 / spread.median;
  const double bytes_per_step = backend.least_bytes_moved(report.totals) /
                                (static_cast<double>(request.num_steps) * physics.parcels.num);
  const double bandwidth = backend.measure_copy_bandwidth(kCopyBytes);
  json["bench"] = {{"repeats", options.bench_repeats},
                   {"steps", options.bench_steps},
                   {"warmup", options.bench_warmup},
                   {"ns_per_particle_step_median", spread.median},
                   {"ns_per_particle_step_min", spread.min},
                   {"ns_per_particle_step_max", spread.max},
                   {"least_bytes_per_particle_step", bytes_per_step},
                   {"copy_bandwidth_bytes_per_s", bandwidth}};
  fmt::print(
      "{}: {} parcels, {}, {}: {:.3g} ns per parcel-step (min {:.3g}, max {:.3g}), {:.4g} Gps, {:.4g} ms per "
      "step\n",
      backend.device(), physics.parcels.num, settings.name, json["method"].get<std::string>(), spread.median,
      spread.min, spread.max, 1.0 / spread.median, spread.median * physics.parcels.num * 1e-6);
  for (std::size_t phase = 0; phase < kNumPhases; ++phase) {
    const double ms = report.times.ms[phase] / request.num_steps;
    if (ms > 0.0) fmt::print("  {:<18} {:10.4f} ms per step\n", kPhaseNames[phase], ms);
  }
  fmt::print(
      "  at least {:.3g} bytes per parcel-step: {:.3g} GB/s, {:.0f} % of the copy bandwidth of {:.4g} GB/s\n",
      bytes_per_step, bytes_per_step / spread.median,
      100.0 * bytes_per_step / spread.median * 1e9 / bandwidth, 1e-9 * bandwidth);
  fmt::print("  state hash {}\n", json["state_hash"].get<std::string>());
  if (!options.bench_json.empty()) write_report(options.bench_json, json);
}

void print_frame_times(const nlohmann::json& report) {
  const auto ms = [](const nlohmann::json& value) { return value.is_null() ? 0.0 : value.get<double>(); };
  const auto row = [&](const char* name, const nlohmann::json& times) {
    fmt::print("  {:<18} {:10.4f} {:10.4f}\n", name, ms(times["median"]), ms(times["p99"]));
  };
  fmt::print("{}: {} parcels, {}, {}; milliseconds per frame\n  {:<18} {:>10} {:>10}\n",
             report["device"].get<std::string>(), report["num_parcels"].get<std::uint64_t>(),
             report["scene"].get<std::string>(), report["method"].get<std::string>(), "", "median", "p99");
  row("whole frame", report["frame_ms"]);
  for (const char* phase : kPhaseNames) row(phase, report["phase_ms"][phase]);
  fmt::print("  state hash {}\n", report["state_hash"].get<std::string>());
}

}  // namespace pf
