// Stability: heat maps of the worst failure of each method, and breaking points that theory knows.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <mutex>
#include <tuple>

#include "app/energy_watch.hpp"
#include "app/scene_run.hpp"
#include "lab/frame_cases.hpp"
#include "lab/gas_case.hpp"
#include "lab/reference.hpp"
#include "lab/stability_cases.hpp"
#include "lab/study.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr Method kMappedMethods[] = {Method::impulse, Method::spring, Method::exact};
constexpr double kTolerance = 0.05;  // of rate and energy: above three standard errors of the maps' runs
constexpr double kOverlap = 0.1;     // diameters
constexpr std::int64_t kMapDiscs = 1000;
constexpr double kMapCollisions = 10.0;  // per disc

std::vector<double> map_steps(bool quick) {
  std::vector<double> steps;
  const double factor = quick ? 2.0 : std::sqrt(2.0);
  for (double dt = 2.0; dt > 0.0035; dt /= factor) steps.push_back(dt);
  return steps;
}

// The worst failure of a run, tested from worst to harmless. num_collisions: length of the run in collisions
// of a disc by theory; energy may be off by the tolerance in kMapCollisions of them, so that the scatter of
// longer runs is not judged.
const char* class_of(const json& row, double expected_energy_ratio, double expected_collisions,
                     double num_collisions) {
  const auto value = [&](const char* key) {
    return row.at(key).is_number() ? row.at(key).get<double>() : INFINITY;
  };
  if (value("num_invalid") > 0.0 || !(value("energy_ratio") < EnergyWatch::kBlownUp)) return "blown up";
  const double energy =
      std::pow(value("energy_ratio") / expected_energy_ratio, kMapCollisions / num_collisions);
  if (energy > 1.0 + kTolerance) return "energy too high";
  if (energy < 1.0 - kTolerance) return "energy too low";
  if (value("collisions") < (1.0 - kTolerance) * expected_collisions) return "collisions missed";
  return value("max_overlap") > kOverlap ? "overlap" : "fine";
}

struct Expected {
  double energy_ratio, collisions;
};

// Result of the reference for a case, from the same start.
Expected expected_of(const GasCase& gas, double duration) {
  static std::map<std::tuple<double, double, double>, Expected> known;
  static std::mutex guard;
  const std::lock_guard lock(guard);
  const auto [at, is_new] = known.try_emplace({gas.area_fraction, gas.restitution, duration});
  if (!is_new) return at->second;
  const GasRun start(gas, {Method::exact, 0.01}, make_cpu_backend(1));
  ReferenceOptions options;
  options.contact_clock_s = 1e-3 / theory_rate(gas.area_fraction);  // no collapse within the run
  Reference reference(start.physics, reference_parcels(start.physics.world, equilibrated(gas)), BallState{},
                      options);
  const double before = reference.measure().parcel_energy_j;
  reference.run_until(duration);
  at->second = {
      reference.measure().parcel_energy_j / before,
      2.0 * static_cast<double>(reference.totals().num_collisions) / static_cast<double>(gas.num_parcels)};
  return at->second;
}

json map_cell(const LabDevice& device, const char* map, const GasCase& gas, Method method, double dt) {
  GasSteps steps{method, dt};
  const double collisions_per_step = theory_rate(gas.area_fraction) * dt;
  // Whole steps of that length, at least one for each block of the measurement.
  steps.collisions = kGasBlocks * collisions_per_step *
                     std::max(1.0, std::round(kMapCollisions / (kGasBlocks * collisions_per_step)));
  // Springs hold energy that is not lost. Where nothing cools, the measurement starts when contacts have
  // built up.
  steps.warmup = gas.restitution == 1.0 ? 2.0 : 0.0;
  steps.contact_clock = method == Method::exact ? 1e-3 / theory_rate(gas.area_fraction) : 0.0;
  json row = measure_gas(gas, steps, device.make());
  const Expected expected = expected_of(gas, row.at("duration"));
  row["map"] = map;
  row["step"] = dt;
  row["class"] = class_of(row, expected.energy_ratio, expected.collisions, steps.collisions);
  row["true_energy_ratio"] = expected.energy_ratio;
  row["true_collisions"] = expected.collisions;
  return row;
}

// A heavy disc in the gas, ten times as wide: energy of all, and hits for comparison with `exact`.
json mass_cell(const LabDevice& device, Method method, double dt, double mass_ratio) {
  Settings s = gas_settings({kMapDiscs, 0.2, 1.0});
  add_resting_ball(s, mass_ratio, 5.0);
  s.friction = 0.0;
  s.method = method;
  SceneRun run(s, device.make());
  const auto steps_for = [dt](double collisions) {
    return static_cast<std::uint32_t>(std::max(1.0, std::round(collisions / (theory_rate(0.2) * dt))));
  };
  run.advance(steps_for(2.0), dt);  // as in map_cell
  const double before = run.backend->measure().energy_j();
  const std::uint32_t num_steps = steps_for(kMapCollisions);
  const StepReport report = run.advance(num_steps, dt);
  json row = {{"map", "mass ratio"},
              {"method", method_name(method)},
              {"step", dt},
              {"mass_ratio", mass_ratio},
              {"energy_ratio", run.backend->measure().energy_j() / before},
              {"collisions", 2.0 * static_cast<double>(report.totals.num_collisions) / kMapDiscs},
              {"max_overlap", report.totals.max_overlap_diameters},
              {"ball_hits", report.totals.num_ball_hits},
              {"num_invalid", report.totals.num_invalid}};
  // A start from the lattice has no expected number of collisions: energy and overlap alone are judged.
  row["class"] = class_of(row, 1.0, 0.0, kMapCollisions);
  return row;
}

struct StabilityPlanner {
  const LabContext& context;
  std::vector<LabPoint> points;

  void add(const std::string& key, std::function<json()> measure) {
    points.push_back({key, std::move(measure)});
  }

  void add_maps(const LabDevice& device) {
    for (const Method method : kMappedMethods) {
      for (const double dt : map_steps(context.quick)) add_map_cells(device, method, dt);
    }
  }

  void add_map_cells(const LabDevice& device, Method method, double dt) {
    const std::string which = fmt::format("{}/{:.4g}", method_name(method), dt);
    for (const double eta : {0.05, 0.1, 0.2, 0.35, 0.5, 0.65}) {
      add(fmt::format("area fraction/{}/{}", which, eta), [device, method, dt, eta] {
        return map_cell(device, "area fraction", {kMapDiscs, eta, 1.0}, method, dt);
      });
    }
    for (const double e : {0.5, 0.7, 0.9, 1.0}) {
      add(fmt::format("restitution/{}/{}", which, e), [device, method, dt, e] {
        return map_cell(device, "restitution", {kMapDiscs, 0.2, e}, method, dt);
      });
    }
    for (const double ratio : {1.0, 1e2, 1e4, 1e6}) {
      add(fmt::format("mass ratio/{}/{}", which, ratio),
          [device, method, dt, ratio] { return mass_cell(device, method, dt, ratio); });
    }
  }

  void add_missed(const LabDevice& device) {
    for (const Method method : kMappedMethods) {
      for (const double step : {0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0}) {
        if (method == Method::spring && step > 0.2)
          continue;  // a contact of 20 steps lasts longer than the passage
        add(fmt::format("missed/{}/{}", method_name(method), step), [device, method, step] {
          const Share share = missed_share(method, step, device.make());
          return json{{"map", "missed"},
                      {"method", method_name(method)},
                      {"step", step},
                      {"missed", share.value},
                      {"sigma", share.sigma}};
        });
      }
    }
  }

  void add_curves(const LabDevice& device) {
    for (const double theta : {0.01, 0.02, 0.05, 0.1, 0.2, 0.5}) {
      add(fmt::format("turn/{}", theta), [device, theta] {
        return json{{"map", "turn"},
                    {"step", theta},
                    {"rotation", turned_speed(theta, *device.make())},
                    {"euler", euler_turned_speed(theta)}};
      });
    }
    for (const double step : {0.02, 0.05, 0.1, 0.2, 0.4, 0.55, 0.637, 0.75, 0.9, 1.2}) {
      add(fmt::format("spring pair/{}", step), [device, step] {
        return json{{"map", "spring pair"},
                    {"step", step},
                    {"energy_ratio", spring_pair_energy(step, device.make())}};
      });
    }
    for (const Method method : kMappedMethods) add_triples(device, method);
  }

  void add_triples(const LabDevice& device, Method method) {
    for (const int degrees : {30, 35, 40, 45, 50, 55, 60}) {
      add(fmt::format("fork/{}/{}", method_name(method), degrees), [device, method, degrees] {
        return json{{"map", "fork"},
                    {"method", method_name(method)},
                    {"degrees", degrees},
                    {"energy_ratio", fork_energy(method, degrees * kPi / 180.0, device.make())}};
      });
    }
    add(fmt::format("head-on/{}", method_name(method)), [device, method] {
      return json{{"map", "head-on"},
                  {"method", method_name(method)},
                  {"energy_ratio", head_on_energy(method, device.make())}};
    });
  }

  void add_frames() {
    for (const Method method : {Method::impulse, Method::exact}) {
      for (const FrameCase& flight : frame_cases(method, context.quick)) {
        const char* clock = flight.settings.contact_clock == 0.0 ? "/no clock" : "";
        add(fmt::format("frames/{}/{}/{:g}{}", method_name(method), flight.axis, flight.value, clock),
            [flight, quick = context.quick] {
              json row = measure_frames(flight, quick);
              row["map"] = "frames";
              return row;
            });
        points.back().is_timing = true;
      }
    }
  }

  void add_collapse() {
    for (const double e : {0.3, 0.4, 0.5, 0.6, 0.8}) {
      for (const double clock : {0.0, 1e-6, 1e-4, 1e-3, 1e-2, 1e-1}) {
        add(fmt::format("collapse/{}/{}", e, clock),
            [e, clock, wanted = context.quick ? 20'000.0 : 200'000.0] {
              const Collapse result = cool_with_clock(e, clock, wanted);
              return json{{"map", "collapse"},
                          {"restitution", e},
                          {"clock", clock},
                          {"class", result.collapsed             ? "collapsed"
                                    : result.reached_share < 1.0 ? "stopped"
                                                                 : "fine"},
                          {"reached_share", result.reached_share},
                          {"events_per_disc", result.events_per_disc}};
            });
      }
    }
  }
};

std::vector<LabPoint> plan_stability(const LabContext& context) {
  StabilityPlanner planner{context, {}};
  // States are the same on every device, to the last bit: one device is enough.
  const LabDevice device{"cpu", [] { return make_cpu_backend(1); }};
  planner.add_maps(device);
  planner.add_missed(device);
  planner.add_curves(device);
  planner.add_collapse();
  planner.add_frames();
  for (const double num : {1e3, 1e4, 1e5, 1e6, 1e7, 1e8}) {
    planner.add(fmt::format("positions/{:g}", num), [num] {
      return json{{"map", "positions"},
                  {"num_parcels", num},
                  {"float", float_position_step(num)},
                  {"fixed", unit_position_step(num)}};
    });
  }
  return std::move(planner.points);
}

}  // namespace

Study stability_study() {
  return {"stability",
          "Where each method breaks",
          "Each cell is a short run; its colour is the worst failure in it. The right edge of a white area "
          "is the longest safe time step; lines are theory, dots are measured.",
          plan_stability,
          [](json&) {},
          true};
}

}  // namespace pf
