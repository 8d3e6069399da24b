// Gas dynamics: shocks, blasts and the ball in a stream, against theory.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "lab/flow_case.hpp"
#include "lab/flow_layer.hpp"
#include "lab/gas_dynamics_summary.hpp"
#include "lab/study.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

using nlohmann::json;

// Parcels and seeds of the two forms of the study.
struct FlowSizes {
  std::int64_t shock_parcels, blast_parcels, drag_parcels;
  double shock_length;  // half of the world, mean free paths
  int shock_seeds, blast_seeds, drag_seeds, layer_seeds;
};
constexpr FlowSizes kQuick = {24000, 30000, 60000, 200.0, 2, 2, 2, 24};
constexpr FlowSizes kFull = {100000, 200000, 400000, 350.0, 24, 6, 6, 3000};
constexpr FlowSizes kOnDevice = {4000000, 10000000, 8000000, 350.0, 2, 2, 2, 3};  // of a GPU

// On a GPU the flows of large balls take all its parcels. Those of small ones are as exact with fewer.
constexpr std::int64_t kSmallBallParcels = 2000000;

// A method with a step length: 0 for `exact`.
struct Setting {
  Method method = Method::exact;
  double displacement = 0.0;  // diameters
};

// Runs of a ball whose shock is at rest: from five on their scatter says how far they are off.
constexpr int kSettledSeeds = 6;

// The layer in front of the court's ball: its area fraction and its ball radius over the mean free path.
DragCase layer_of_court(bool large) {
  DragCase drag;
  drag.radius_over_path = 3.45;
  drag.area_fraction = 0.1;
  if (large) {
    drag.length = 84.0;
    drag.height = 54.0;
  }
  return drag;
}

FlowSteps steps_of(const Setting& setting) { return {setting.method, setting.displacement, 1.0}; }

std::string name_of(const Setting& setting) {
  return setting.method == Method::exact
             ? "exact"
             : fmt::format("{}/{:g}", method_name(setting.method), setting.displacement);
}

void label(json& row, const char* group, const std::string& name, const Setting& setting, std::int64_t seed) {
  row["group"] = group;
  row["case"] = name;
  row["method"] = method_name(setting.method);
  row["displacement_per_step"] = setting.displacement;
  row["seed"] = seed;
}

struct FlowPlanner {
  FlowSizes sizes;
  LabDevice device;
  std::vector<LabPoint>& points;

  // The whole of another device than the CPU is one run's: it is not shared.
  void add(const std::string& key, std::function<json(Backend&)> measure) {
    const bool alone = device.name != "cpu";
    points.push_back({device.name + "/" + key,
                      [measure = std::move(measure), device = device, alone] {
                        json row = measure(alone ? *device.make() : *make_cpu_backend(1));
                        row["device"] = device.name;
                        return row;
                      },
                      alone});
  }

  void add_shocks(double area_fraction, double mach, const Setting& setting, int num_seeds) {
    const std::string name = fmt::format("area fraction {:g}, Mach {:g}", area_fraction, mach);
    for (int seed = 1; seed <= num_seeds; ++seed) {
      const ShockCase shock{area_fraction, mach, sizes.shock_parcels, sizes.shock_length, seed};
      add(fmt::format("shock/{:g}/{:g}/{}/{}", area_fraction, mach, name_of(setting), seed),
          [=](Backend& backend) {
            json row = measure_shock(shock, steps_of(setting), backend);
            label(row, "shock", name, setting, shock.seed);
            row["area_fraction"] = area_fraction;
            row["mach"] = mach;
            return row;
          });
    }
  }

  void add_blasts(double area_fraction) {
    for (int seed = 1; seed <= sizes.blast_seeds; ++seed) {
      const BlastCase blast{area_fraction, sizes.blast_parcels, 100.0, seed};
      add(fmt::format("blast/{:g}/exact/{}", area_fraction, seed), [=](Backend& backend) {
        json row = measure_blast(blast, {}, backend);
        label(row, "blast", fmt::format("area fraction {:g}", area_fraction), {}, blast.seed);
        row["area_fraction"] = area_fraction;
        return row;
      });
    }
  }

  // The gas that the start heats must flow off. The bow shock comes to rest after some 40 ball radii of the
  // stream's way, for which a CPU has too little time, and a ball of 100 mean free paths takes too many
  // parcels.
  bool settles(double radius_over_path) const {
    return device.name != "cpu" && sizes.drag_parcels >= kOnDevice.drag_parcels && radius_over_path <= 30.0;
  }
  void set_long_stream(DragCase& drag) const {
    if (settles(drag.radius_over_path)) {
      drag.length = 84.0;
      drag.height = 54.0;
      drag.start = 46.0;
      drag.end = 54.0;
    } else {
      drag.length = 28.0;
      drag.height = 18.0;
      drag.start = 9.0;
      drag.end = 15.0;
    }
  }

  // contacts: among parcels; without them the flow is free-molecular.
  void add_drag(double radius_over_path, bool contacts) {
    const bool is_judged = radius_over_path >= kMinJudgedRadius && settles(radius_over_path);
    const int num_seeds = is_judged ? kSettledSeeds : sizes.drag_seeds;
    for (int seed = 1; seed <= num_seeds; ++seed) {
      DragCase drag;
      drag.radius_over_path = radius_over_path;
      drag.num_parcels =
          radius_over_path < 3.0 ? std::min(sizes.drag_parcels, kSmallBallParcels) : sizes.drag_parcels;
      drag.contacts = contacts;
      drag.seed = seed;
      if (radius_over_path >= 3.0) set_long_stream(drag);
      const std::string name = contacts ? fmt::format("R / path {:g}", radius_over_path) : "no contacts";
      add(fmt::format("drag/{}/exact/{}", name, seed), [=](Backend& backend) {
        json row = measure_drag(drag, {}, backend);
        label(row, "drag", name, {}, drag.seed);
        row["radius_over_path"] = contacts ? drag.radius_over_path : 0.0;
        row["speed_ratio"] = drag.speed_ratio;
        return row;
      });
    }
  }

  // On a GPU for its cost alone, in a large world that keeps it busy: its bits, so its errors, are the CPU's.
  void add_layer(const Setting& setting) {
    points.push_back({fmt::format("{}/layer/{}", device.name, name_of(setting)),
                      [setting, device = device, num = sizes.layer_seeds] {
                        json row = measure_layer(layer_of_court(device.name != "cpu"), steps_of(setting), num,
                                                 device);
                        label(row, "layer", "area fraction 0.1, R / path 3.45", setting, num);
                        row["device"] = device.name;
                        return row;
                      },
                      true});
  }
};

constexpr Setting kLayer[] = {{},
                              {Method::impulse, 2.0},
                              {Method::impulse, 1.0},
                              {Method::impulse, 0.5},
                              {Method::impulse, 0.25},
                              {Method::impulse, 0.125},
                              {Method::spring, 0.25},
                              {Method::spring, 0.125},
                              {Method::spring, 0.0625},
                              {Method::spring, 0.03125}};
constexpr Setting kQuickLayer[] = {
    {}, {Method::impulse, 1.0}, {Method::impulse, 0.25}, {Method::spring, 0.125}};
constexpr Setting kShocks[] = {
    {Method::impulse, 1.0}, {Method::impulse, 0.5}, {Method::impulse, 0.25}, {Method::spring, 0.25}};

void add_layers(FlowPlanner& planner, bool quick) {
  for (const Setting& setting :
       quick ? std::span<const Setting>(kQuickLayer) : std::span<const Setting>(kLayer))
    planner.add_layer(setting);
}

void add_methods(FlowPlanner& planner, bool quick) {
  for (const Setting& setting : std::span<const Setting>(kShocks).first(quick ? 1 : std::size(kShocks)))
    planner.add_shocks(0.2, 2.0, setting, 1);
}

void add_exact(FlowPlanner& planner, bool quick) {
  const FlowSizes& sizes = planner.sizes;
  planner.add_shocks(0.01, 2.0, {}, sizes.shock_seeds);
  planner.add_shocks(0.2, 2.0, {}, sizes.shock_seeds);
  planner.add_drag(0.1, false);
  for (const double radius :
       quick ? std::vector{0.1, 1.0, 3.0} : std::vector{0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0})
    planner.add_drag(radius, true);
  planner.add_blasts(0.2);
  if (quick) return;
  planner.add_shocks(0.01, 3.0, {}, sizes.shock_seeds);
  planner.add_shocks(0.01, 5.0, {}, sizes.shock_seeds);
  planner.add_shocks(0.2, 3.0, {}, sizes.shock_seeds);
  planner.add_shocks(0.4, 2.0, {}, sizes.shock_seeds);
  planner.add_blasts(0.1);
  planner.add_blasts(0.3);
}

// The flows by `exact` run on the last device alone: on any other they would only repeat themselves.
std::vector<LabPoint> plan_gas_dynamics(const LabContext& context) {
  std::vector<LabPoint> points;
  for (const LabDevice& device : context.devices) {
    const bool is_cpu = device.name == "cpu", is_last = &device == &context.devices.back();
    FlowPlanner planner{context.quick ? kQuick : is_cpu ? kFull : kOnDevice, device, points};
    if (is_last) add_exact(planner, context.quick);
    if (is_cpu) add_methods(planner, context.quick);
    add_layers(planner, context.quick);
    if (!is_cpu && !context.quick) planner.add_drag(100.0, true);  // 5 million parcels
  }
  return points;
}

}  // namespace

Study gas_dynamics_study() {
  return {
      "gas-dynamics",
      "Shocks, blasts and the layer in front of the ball",
      "Dots are measured, with standard errors; lines are theory, with the equation of state of Kolafa and "
      "Rottner. exact is judged, the other methods are shown beside it.",
      plan_gas_dynamics,
      conclude_gas_dynamics,
      true,
      true};
}

}  // namespace pf
