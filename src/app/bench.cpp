#include "app/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/domain_checks.hpp"
#include "app/report.hpp"
#include "app/simulation.hpp"
#include "app/step_request.hpp"
#include "core/error.hpp"
#include "core/statistics.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

// Larger than any cache.
constexpr std::size_t kCopyBytes = 256ULL << 20U;

struct Spread {
  double median, min, max;
};

Spread spread_of(std::vector<double> values) {
  const auto [min, max] = std::ranges::minmax(values);
  return {median_of(values), min, max};
}

// 0 for null.
double number_of(const nlohmann::json& value) { return value.is_null() ? 0.0 : value.get<double>(); }

// Milliseconds of one request by the host's clock.
double timed_advance(Backend& backend, const StepRequest& request, StepReport& report) {
  const Clock::time_point start = Clock::now();
  report = backend.advance(request);
  return milliseconds_since(start);
}

struct Bench {
  const Options& options;
  Settings settings;
  Physics physics;
  StepRequest request;
  StepReport report;                // of the last repeat
  std::vector<double> ns_per_step;  // and parcel, of each repeat

  double parcel_steps() const { return static_cast<double>(request.num_steps) * physics.parcels.num; }
};

Bench prepare(const Options& options, Backend& backend) {
  Bench bench{options, options.settings, {}, {}, {}, {}};
  Settings& settings = bench.settings;
  settings.num_parcels = resolve_num_parcels(settings, backend.name());
  bench.physics = derive_physics(settings);
  if (bench.physics.parcels.num == 0)
    throw UserError("bench: air.kind is not parcels, there is nothing to time");
  check_backend(settings, bench.physics, backend);
  const BallState ball = initial_ball(settings);
  const Spawner spawner(settings, bench.physics, ball);
  backend.reset(bench.physics, spawner.plan(), ball);
  bench.request = step_request(settings, bench.physics, 1, plan_frame(settings, bench.physics, ball).dt_s);
  return bench;
}

// One entry of the record per repeat, with the times of a step.
void measure(Bench& bench, Backend& backend, RunRecord& record) {
  StepRequest& request = bench.request;
  request.num_steps = static_cast<std::uint32_t>(bench.options.bench_steps);
  for (int repeat = 0; repeat < bench.options.bench_repeats; ++repeat) {
    const double ms = timed_advance(backend, request, bench.report);
    bench.ns_per_step.push_back(ms * 1e6 / bench.parcel_steps());
    PhaseTimes per_step = bench.report.times;
    for (double& phase : per_step.ms) phase /= request.num_steps;
    record.add_frame(per_step, bench.report.totals, request.dt_s);
  }
}

nlohmann::json bench_report(const Bench& bench, Backend& backend, const RunRecord& record) {
  const Spread spread = spread_of(bench.ns_per_step);
  nlohmann::json report = record.finish(bench.settings, bench.physics, backend, bench.report.ball, 0.0);
  for (const char* key : {"frame_ms", "host_ms", "gpu_ms"}) report.erase(key);  // there are no frames
  report["ns_per_parcel_step"] = spread.median;
  report["parcel_steps_per_s"] = 1e9 / spread.median;
  report["chosen"] = to_json(bench.options.chosen);
  report["bench"] = {
      {"repeats", bench.options.bench_repeats},
      {"steps", bench.options.bench_steps},
      {"warmup", bench.options.bench_warmup},
      {"ns_per_parcel_step_median", spread.median},
      {"ns_per_parcel_step_min", spread.min},
      {"ns_per_parcel_step_max", spread.max},
      {"least_bytes_per_parcel_step", backend.min_bytes_moved(bench.report.totals) / bench.parcel_steps()},
      {"copy_bandwidth_bytes_per_s", backend.measure_copy_bandwidth(kCopyBytes)}};
  return report;
}

void print_bench(const Bench& bench, const nlohmann::json& report) {
  const Spread spread = spread_of(bench.ns_per_step);
  const double bytes_per_step = report["bench"]["least_bytes_per_parcel_step"];
  const double bandwidth = report["bench"]["copy_bandwidth_bytes_per_s"];
  fmt::print(
      "{}: {} parcels, {}, {}: {:.3g} ns per parcel-step (min {:.3g}, max {:.3g}), {:.4g} Gps, {:.4g} ms per "
      "step\n",
      report["device"].get<std::string>(), bench.physics.parcels.num, bench.settings.name,
      report["method"].get<std::string>(), spread.median, spread.min, spread.max, 1.0 / spread.median,
      spread.median * bench.physics.parcels.num * 1e-6);
  for (std::size_t phase = 0; phase < kNumPhases; ++phase) {
    const double ms = number_of(report["phase_ms"][kPhaseNames[phase]]["median"]);
    if (ms > 0.0) fmt::print("  {:<18} {:10.4f} ms per step\n", kPhaseNames[phase], ms);
  }
  fmt::print(
      "  at least {:.3g} bytes per parcel-step: {:.3g} GB/s, {:.0f} % of the copy bandwidth of {:.4g} GB/s\n",
      bytes_per_step, bytes_per_step / spread.median,
      100.0 * bytes_per_step / spread.median * 1e9 / bandwidth, 1e-9 * bandwidth);
  if (report["domain_link"].is_string())
    fmt::print("  between domains: {}\n", report["domain_link"].get<std::string>());
  fmt::print("  state hash {}\n", report["state_hash"].get<std::string>());
}

}  // namespace

void run_bench(const Options& options, Backend& backend) {
  Bench bench = prepare(options, backend);
  bench.request.num_steps = static_cast<std::uint32_t>(options.bench_warmup);
  if (options.bench_warmup > 0) timed_advance(backend, bench.request, bench.report);
  RunRecord record(bench.physics, backend.measure(), backend.device());
  record.start_clock();
  measure(bench, backend, record);
  const nlohmann::json json = bench_report(bench, backend, record);
  print_bench(bench, json);
  if (!options.bench_json.empty()) write_report(options.bench_json, json);
}

nlohmann::json recording_cost(const std::vector<nlohmann::json>& plain,
                              const std::vector<nlohmann::json>& recorded) {
  const auto median_over = [](const std::vector<nlohmann::json>& runs, const auto& value_of) {
    std::vector<double> values;
    for (const nlohmann::json& run : runs) values.push_back(value_of(run));
    return median_of(values);
  };
  const auto frame_ms = [](const nlohmann::json& run) { return number_of(run["frame_ms"]["median"]); };
  const auto mean_ms = [](const nlohmann::json& run) { return number_of(run["frames"]["frame_ms"]); };
  const double without_ms = median_over(plain, frame_ms);
  const double with_ms = median_over(recorded, frame_ms);
  const nlohmann::json& film = recorded.back()["record"];
  std::int64_t num_dropped = 0;
  for (const nlohmann::json& run : recorded) num_dropped += run["record"]["dropped"].get<std::int64_t>();
  const double period_ms = 1e3 / film["rate_hz"].get<double>();
  return {{"rounds", recorded.size()},
          {"frame_ms_without", without_ms},
          {"frame_ms_with", with_ms},
          {"ratio", with_ms / without_ms},
          {"mean_frame_ms_without", median_over(plain, mean_ms)},
          {"mean_frame_ms_with", median_over(recorded, mean_ms)},
          {"cost_ms", with_ms - without_ms},
          {"share_of_period", (with_ms - without_ms) / period_ms},
          {"period_ms", period_ms},
          {"film_frames", film["frames"]},
          {"dropped", num_dropped},
          {"write_ms_per_frame", film["write_ms_per_frame"]},
          {"encoder", film["encoder"]},
          {"width", film["width"]},
          {"height", film["height"]}};
}

namespace {

void print_recording_cost(const nlohmann::json& cost) {
  fmt::print(
      "recording {}x{} ({}), medians of {} rounds without and with, in turn:\n"
      "  whole frame {:.4f} ms without, {:.4f} ms with: ratio {:.3f}; means {:.4f} and {:.4f} ms\n"
      "  {:.4f} ms more, {:.1f} % of the film's period of {:.2f} ms; {} frames in the last film, {} dropped\n"
      "  written in {:.4f} ms a frame, on a thread of its own\n",
      cost["width"].get<int>(), cost["height"].get<int>(), cost["encoder"].get<std::string>(),
      cost["rounds"].get<int>(), number_of(cost["frame_ms_without"]), number_of(cost["frame_ms_with"]),
      number_of(cost["ratio"]), number_of(cost["mean_frame_ms_without"]),
      number_of(cost["mean_frame_ms_with"]), number_of(cost["cost_ms"]),
      100.0 * number_of(cost["share_of_period"]), number_of(cost["period_ms"]),
      cost["film_frames"].get<std::int64_t>(), cost["dropped"].get<std::int64_t>(),
      number_of(cost["write_ms_per_frame"]));
}

}  // namespace

void print_frame_times(const nlohmann::json& report) {
  const auto row = [&](const char* name, const nlohmann::json& times) {
    fmt::print("  {:<18} {:10.4f} {:10.4f}\n", name, number_of(times["median"]), number_of(times["p99"]));
  };
  fmt::print("{}: {} parcels, {}, {}; milliseconds per frame\n  {:<18} {:>10} {:>10}\n",
             report["device"].get<std::string>(), report["num_parcels"].get<std::uint64_t>(),
             report["scene"].get<std::string>(), report["method"].get<std::string>(), "", "median", "p99");
  row("whole frame", report["frame_ms"]);
  for (std::size_t phase = 0; phase < kNumPhases; ++phase) {
    const nlohmann::json& times = report["phase_ms"][kPhaseNames[phase]];
    const bool is_of_another_method = phase < kNumStepPhases && number_of(times["p99"]) == 0.0;
    if (!is_of_another_method) row(kPhaseNames[phase], times);
  }
  for (const char* phase : {"draw", "panel"}) {
    row(fmt::format("{}, host", phase).c_str(), report["host_ms"][phase]);
    row(fmt::format("{}, GPU", phase).c_str(), report["gpu_ms"][phase]);
  }
  if (report.contains("recording")) print_recording_cost(report["recording"]);
  fmt::print("  state hash {}\n", report["state_hash"].get<std::string>());
}

}  // namespace pf
