#include "app/flight_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/report.hpp"
#include "app/simulation.hpp"
#include "core/error.hpp"
#include "core/statistics.hpp"

namespace pf {
namespace {

using nlohmann::json;

// At the frame rate.
constexpr double kLongestFlight_s = 60.0;
constexpr double kWithoutFlight_s = 6.0;

// All frames' values of one kind.
template <class Value>
json list_of(const std::vector<TimedFrame>& frames, const Value& value_of) {
  json list = json::array();
  for (const TimedFrame& frame : frames) list.push_back(value_of(frame));
  return list;
}

json list_of(const std::vector<TimedFrame>& frames, std::uint64_t StepTotals::*member) {
  return list_of(frames, [member](const TimedFrame& frame) { return frame.totals.*member; });
}

StepTotals sum_of(const std::vector<TimedFrame>& frames) {
  StepTotals sum;
  for (const TimedFrame& frame : frames) sum += frame.totals;
  return sum;
}

double longest_s(const Simulation& simulation) {
  const Settings& settings = simulation.settings();
  if (settings.seconds > 0.0) return settings.seconds;
  const Physics& physics = *simulation.view().physics;
  const bool may_leave =
      physics.ball.exists && !physics.ball.held && physics.world.boundary == Boundary::open;
  return may_leave ? kLongestFlight_s : kWithoutFlight_s;
}

// A device loads its program with the first frame; that belongs to no flight.
void fly_one_frame_and_back(Simulation& simulation) {
  simulation.advance_frame({}, nullptr);
  if (simulation.view().paused) return;
  Commands back;
  back.reset = back.hold = true;
  simulation.advance_frame(back, nullptr);
}

std::vector<TimedFrame> fly(Simulation& simulation, RunRecord& record, const std::atomic<bool>& stop) {
  std::vector<TimedFrame> frames;
  const double num_max = longest_s(simulation) * simulation.settings().frame_rate_hz;
  const bool to_the_end = simulation.settings().seconds == 0.0;
  const FrameView& view = simulation.view();
  while (static_cast<double>(frames.size()) < num_max && !view.paused && !stop) {
    if (to_the_end && simulation.finished_flight()) break;
    const Clock::time_point start = Clock::now();
    simulation.advance_frame({}, nullptr);
    frames.push_back({view.simulated_s, milliseconds_since(start), view.frame_totals});
    record.add_frame(view.times, view.frame_totals, view.dt_s);
  }
  return frames;
}

void print_flight(const json& report, const StepTotals& totals) {
  const json& flight = report["flight"];
  fmt::print(
      "{}: {} parcels, {}, {}, a flight of {} frames; milliseconds per frame\n"
      "  median {:.4g}, 99 % {:.4g}, worst {:.4g} in frame {} (t = {:.4g} s), {:.3g} times the mean\n",
      report["device"].get<std::string>(), report["num_parcels"].get<std::uint64_t>(),
      report["scene"].get<std::string>(), report["method"].get<std::string>(),
      flight["frames"].get<std::uint64_t>(), flight["median_ms"].get<double>(),
      flight["p99_ms"].get<double>(), flight["worst_ms"].get<double>(),
      flight["worst_frame"].get<std::uint64_t>(), flight["worst_at_s"].get<double>(),
      flight["worst_over_mean"].get<double>());
  const json& exact = report["exact"];
  if (!exact.is_null()) {
    fmt::print(
        "  {} events, {} solved, {} rounds, {} retried, largest cluster {} events\n"
        "  overlaps of up to {:.3g} position units, event hash {}\n",
        totals.num_events, totals.num_solved_events, totals.num_rounds, totals.num_retried_steps,
        totals.largest_cluster, exact["max_overlap_units"].get<double>(),
        exact["event_hash"].get<std::string>());
  }
  fmt::print("  state hash {}\n", report["state_hash"].get<std::string>());
}

}  // namespace

json flight_figures(const std::vector<TimedFrame>& frames, bool is_exact) {
  std::vector<double> times_ms;
  double sum_ms = 0.0;
  for (const TimedFrame& frame : frames) {
    times_ms.push_back(frame.ms);
    sum_ms += frame.ms;
  }
  const auto [median_ms, p99_ms] = median_and_p99(times_ms);
  const auto worst = std::max_element(frames.begin(), frames.end(),
                                      [](const TimedFrame& a, const TimedFrame& b) { return a.ms < b.ms; });
  json figures = {{"frames", frames.size()},
                  {"median_ms", median_ms},
                  {"p99_ms", p99_ms},
                  {"worst_ms", worst->ms},
                  {"worst_frame", worst - frames.begin()},
                  {"worst_at_s", worst->simulated_s},
                  {"worst_over_mean", worst->ms * static_cast<double>(frames.size()) / sum_ms},
                  {"simulated_s", list_of(frames, [](const TimedFrame& f) { return f.simulated_s; })},
                  {"ms", list_of(frames, [](const TimedFrame& f) { return f.ms; })}};
  if (!is_exact) return figures;
  figures["events"] = list_of(frames, &StepTotals::num_events);
  figures["solved_events"] = list_of(frames, &StepTotals::num_solved_events);
  figures["rounds"] = list_of(frames, &StepTotals::num_rounds);
  figures["retried_steps"] = list_of(frames, &StepTotals::num_retried_steps);
  figures["largest_cluster"] = list_of(frames, &StepTotals::largest_cluster);
  return figures;
}

int run_flight_bench(const Options& options, std::unique_ptr<Backend> backend,
                     const std::atomic<bool>& stop) {
  Simulation simulation(options.settings, std::move(backend));
  if (simulation.view().num_parcels == 0)
    throw UserError("bench: air.kind is not parcels, there is nothing to time");
  fly_one_frame_and_back(simulation);
  if (simulation.view().paused) {
    fmt::print(stderr, "bench: the flight ended in its first frame: {}\n", simulation.view().message);
    return 1;
  }
  RunRecord record(*simulation.view().physics, simulation.backend().measure(), simulation.backend().device());
  record.start_clock();
  const std::vector<TimedFrame> frames = fly(simulation, record, stop);
  if (frames.empty()) throw UserError("bench: stopped before the first frame");
  const FrameView& view = simulation.view();
  json report = record.finish(simulation.settings(), *view.physics, simulation.backend(), view.ball,
                              view.ball_distance_m);
  report["kind"] = "flight";
  report["chosen"] = to_json(options.chosen);
  report["flight"] = flight_figures(frames, !report["exact"].is_null());
  report["interrupted"] = stop.load();
  report["ended_early"] = view.paused ? json(view.message) : json(nullptr);
  for (const char* key : {"host_ms", "gpu_ms"}) report.erase(key);  // nothing is drawn
  print_flight(report, sum_of(frames));
  if (!options.bench_json.empty()) write_report(options.bench_json, report);
  if (stop) fmt::print(stderr, "bench: the flight was stopped before its end\n");
  if (view.paused) fmt::print(stderr, "bench: the flight ended early: {}\n", view.message);
  return view.paused ? 1 : 0;
}

}  // namespace pf
