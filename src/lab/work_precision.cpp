// Work-precision: the cost of each method's error, over ladders of the time step.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "lab/flight_case.hpp"
#include "lab/parallel_for.hpp"
#include "lab/path_case.hpp"
#include "lab/study.hpp"
#include "lab/work_precision_errors.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

using nlohmann::json;

// Sizes for a device: enough parcels to keep it busy, and a bound on the work of a point.
struct WorkSizes {
  std::int64_t gas_parcels, flight_parcels;
  double gas_collisions;  // per parcel
  double max_work;        // parcel-steps of a point
};

WorkSizes sizes_for(const LabContext& context, const LabDevice& device) {
  if (context.quick) return {4000, 4000, 40.0, 1e300};
  if (device.name == "cpu") return {32000, 20000, 400.0, 1.6e9};
  return {256000, 50000, 100.0, 8e9};
}

constexpr double kAreaFractions[] = {0.05, 0.2, 0.5};
constexpr double kRestitutions[] = {1.0, 0.9};

std::vector<double> halvings(double first, int num) {
  std::vector<double> ladder;
  for (int k = 0; k < num; ++k) ladder.push_back(std::ldexp(first, -k));
  return ladder;
}

// Time steps [d/c]. impulse: the longest step is a thermal displacement of a diameter or a mean time between
// collisions. spring: the longest contact (20 steps) lasts 2 mean times between collisions. exact: the step
// only affects the cost.
std::vector<double> gas_ladder(Method method, double area_fraction, bool quick) {
  const double rate = theory_rate(area_fraction);
  if (method == Method::impulse) return halvings(std::min(1.0, 1.0 / rate), quick ? 8 : 9);
  if (method == Method::spring) return halvings(2.0 / (20.0 * rate), quick ? 7 : 8);
  return halvings(0.2 / rate, 3);
}

json gas_point(const LabContext& context, const LabDevice& device, const GasCase& gas, GasSteps steps) {
  // A cooling gas has no stationary state: every method runs its first collisions.
  const bool cools = gas.restitution < 1.0;
  const WorkSizes sizes = sizes_for(context, device);
  const double work = static_cast<double>(gas.num_parcels) / (theory_rate(gas.area_fraction) * steps.dt);
  // At least 20. The bound on the work raises the statistical error of the shortest steps.
  steps.collisions = cools ? 20.0 : std::clamp(sizes.max_work / work, 20.0, sizes.gas_collisions);
  steps.warmup = cools ? 0.0 : 2.0;
  json row = measure_gas(gas, steps, device.make());
  row["group"] = "gas";
  return row;
}

json path_point(const LabDevice& device, const GasCase& gas, GasSteps steps) {
  steps.collisions = 1.0;
  json row = measure_path(gas, steps, device.make());
  row["group"] = "parcel-path";
  return row;
}

// Times two flights with the whole CPU and flies the rest in parallel; on another device times all. Ends do
// not depend on the device.
std::vector<FlightResult> fly_all(const LabDevice& device, const Settings& settings, int num_seeds) {
  const int num_timed = device.name == "cpu" ? 2 : num_seeds;
  std::vector<FlightResult> flights(static_cast<std::size_t>(num_seeds));
  const auto fly = [&](int k, Backend& backend) {
    Settings s = settings;
    s.seed = k + 1;
    flights[static_cast<std::size_t>(k)] = fly_scene(s, kCourtFlight_s, backend);
  };
  const std::unique_ptr<Backend> backend = device.make();
  for (int k = 0; k < num_timed; ++k) fly(k, *backend);
  parallel_for(num_seeds - num_timed, 0, [&](int k) { fly(num_timed + k, *make_cpu_backend(1)); });
  for (int k = num_timed; k < num_seeds; ++k) flights[static_cast<std::size_t>(k)].wall_ns = INFINITY;
  return flights;
}

// A method's flights over the seeds. Their errors follow when the flights of `exact` are measured.
json fly_seeds(const LabDevice& device, const CourtCase& court, Method method, double displacement,
               int num_seeds) {
  Settings s = court_settings(court);
  s.method = method;
  s.displacement_per_step = displacement;
  json ends = json::array();
  double best_ns = INFINITY, dt_s = 0.0;
  for (const FlightResult& flight : fly_all(device, s, num_seeds)) {
    best_ns = std::min(best_ns, flight.wall_ns);
    dt_s = flight.dt_s;
    ends.push_back({flight.ball.position_m.x, flight.ball.position_m.y, speed_of(flight.ball)});
  }
  const double per_time = s.parcel_speed_mps / (2.0 * derive_physics(s).parcels.radius_m);  // c / d
  const double num = static_cast<double>(court.num_parcels);
  return {{"group", "ball"},
          {"method", method_name(method)},
          {"area_fraction", court.area_fraction},
          {"restitution", court.restitution},
          {"num_parcels", court.num_parcels},
          {"dt", dt_s * per_time},
          {"displacement_per_step", displacement},
          {"start", {s.ball_x_m, s.ball_y_m, std::hypot(s.ball_vx_mps, s.ball_vy_mps)}},
          {"ends", ends},
          {"ns_per_disc_time", best_ns / (num * kCourtFlight_s * per_time)}};
}

// Effect of the number of parcels: 16 flights of `exact`, each with its own start of the air.
json scatter_point(const LabDevice& device, std::int64_t num_parcels) {
  CourtCase court;
  court.num_parcels = num_parcels;
  json row = fly_seeds(device, court, Method::exact, 0.5, 16);
  row["group"] = "parcels";
  return row;
}

// Effect of the number of parcels on a gas between walls: discs keep away from the edge.
json walls_point(const LabContext& context, const LabDevice& device, std::int64_t num_parcels) {
  GasCase gas;
  gas.num_parcels = num_parcels;
  gas.boundary = Boundary::walls;
  GasSteps steps{Method::exact, 0.1 / theory_rate(gas.area_fraction)};
  steps.collisions = (context.quick ? 160'000.0 : 4'000'000.0) / static_cast<double>(num_parcels);
  json row = measure_gas(gas, steps, device.make());
  row["group"] = "parcels";
  return row;
}

std::vector<double> ball_ladder(Method method) {
  if (method == Method::impulse) return halvings(4.0, 7);
  if (method == Method::spring) return halvings(0.5, 4);
  return {0.5};
}

constexpr Method kMeasuredMethods[] = {Method::exact, Method::impulse, Method::spring};

struct WorkPlanner {
  const LabContext& context;
  std::vector<LabPoint> points;

  struct Series {
    const char* group;
    double area_fraction, restitution;
    Method method;
  };

  void add(const LabDevice& device, const Series& series, double step, std::function<json()> measure) {
    points.push_back({fmt::format("{}/{}/eta={}/e={}/{}/{:.4g}", device.name, series.group,
                                  series.area_fraction, series.restitution, method_name(series.method), step),
                      [name = device.name, measure = std::move(measure)] {
                        json row = measure();
                        row["device"] = name;
                        return row;
                      }});
  }

  void add_gas(const LabDevice& device, double eta, double e) {
    const GasCase gas{sizes_for(context, device).gas_parcels, eta, e};
    for (const Method method : kMeasuredMethods) {
      for (const double dt : gas_ladder(method, eta, context.quick)) {
        add(device, {"gas", eta, e, method}, dt, [this_context = context, device, gas, method, dt] {
          return gas_point(this_context, device, gas, {method, dt});
        });
      }
    }
  }

  void add_paths(const LabDevice& device, double eta) {
    const GasCase gas{context.quick ? 4000 : 16000, eta, 1.0};
    const double mean_time = 1.0 / theory_rate(eta);
    for (const Method method : kMeasuredMethods) {
      const int num = method == Method::exact ? 1 : 8;
      const double first = method == Method::spring    ? 1.0 / 64
                           : method == Method::impulse ? 1.0 / 16
                                                       : 1.0 / 8;
      for (const double dt : halvings(first * mean_time, num)) {
        add(device, {"parcel-path", eta, 1.0, method}, dt, [device, gas, method, dt] {
          return path_point(device, gas, {method, dt});
        });
      }
    }
  }

  void add_flights(const LabDevice& device, double eta, double e) {
    const CourtCase court{sizes_for(context, device).flight_parcels, eta, e};
    for (const Method method : kMeasuredMethods) {
      for (const double displacement : ball_ladder(method)) {
        add(device, {"ball", eta, e, method}, displacement,
            [num_seeds = context.quick ? 8 : 16, device, court, method, displacement] {
              return fly_seeds(device, court, method, displacement, num_seeds);
            });
      }
    }
  }
};

// The effect is one of the model, not of the device: each number is flown on one, the largest on a GPU.
void add_numbers_of_parcels(WorkPlanner& planner) {
  const LabContext& context = planner.context;
  const LabDevice &cpu = context.devices.front(), &last = context.devices.back();
  const std::int64_t largest_on_cpu = context.quick ? 16000 : 64000;
  const std::int64_t largest = context.quick || last.name == "cpu" ? largest_on_cpu : 1'024'000;
  for (std::int64_t num = 500; num <= largest; num *= 2) {
    const CourtCase court;
    const LabDevice& device = num <= largest_on_cpu ? cpu : last;
    planner.add(device, {"parcels", court.area_fraction, court.restitution, Method::exact},
                static_cast<double>(num), [device, num] { return scatter_point(device, num); });
  }
  for (const std::int64_t num : {250, 1000, 4000, 16000}) {
    planner.add(cpu, {"walls", 0.2, 1.0, Method::exact}, static_cast<double>(num),
                [context, cpu, num] { return walls_point(context, cpu, num); });
  }
}

std::vector<LabPoint> plan_work_precision(const LabContext& context) {
  WorkPlanner planner{context, {}};
  for (const LabDevice& device : context.devices) {
    for (const double e : kRestitutions) {
      for (const double eta : kAreaFractions) planner.add_gas(device, eta, e);
    }
    for (const double eta : kAreaFractions) planner.add_paths(device, eta);
    for (const double e : kRestitutions) {
      for (const double eta : kAreaFractions) planner.add_flights(device, eta, e);
    }
  }
  add_numbers_of_parcels(planner);
  return std::move(planner.points);
}

}  // namespace

Study work_precision_study() {
  return {
      "work-precision",
      "Error against cost",
      "Each dot is one method with one time step: lower is more accurate, further left is cheaper, and the "
      "line joins the dots that no other beats. A hollow dot with an arrow is an upper bound: the run "
      "cannot resolve the error.",
      plan_work_precision,
      conclude_work_precision,
      false,
      true};
}

}  // namespace pf
