#include "lab/gas_dynamics_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/json_number.hpp"
#include "lab/blast_fit.hpp"
#include "lab/error_entry.hpp"
#include "lab/flow_case.hpp"
#include "lab/mean_error.hpp"
#include "lab/theory.hpp"
#include "model/free_flow.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr double kShockTolerance = 5e-3, kBlastTolerance = 1e-2, kDragTolerance = 1e-2,
                 kStagnationTolerance = 2e-2;
// From this start of the measurement on the bow shock is at rest, ball radii over the stream's speed.
constexpr double kSettled = 40.0;
// The scatter of fewer runs says too little of their error.
constexpr std::size_t kMinRuns = 5;

// Rows of one case, method and step.
struct Runs {
  json first;
  std::vector<json> rows;
  double ease = 1.0;  // factor on what is allowed

  bool holds(const json& row) const {
    for (const char* key : {"device", "group", "case", "method", "displacement_per_step"}) {
      if (row.at(key) != first.at(key)) return false;
    }
    return true;
  }
  template <class Get>
  MeanError mean(const Get& get) const {
    return mean_of_each(rows, get);
  }
  MeanError mean_of(const char* key) const {
    return mean(
        [&](const json& row) { return row.value(key, json()).is_number() ? row[key].get<double>() : NAN; });
  }
};

// Cost of the quickest run: other work of the machine only adds to it.
double min_cost(const Runs& runs) {
  double lowest = INFINITY;
  for (const json& row : runs.rows) lowest = std::min(lowest, row.at("ns_per_disc_time").get<double>());
  return lowest;
}

std::vector<Runs> grouped(const json& points) {
  std::vector<Runs> groups;
  for (const json& row : points) {
    const auto found =
        std::find_if(groups.begin(), groups.end(), [&](const Runs& runs) { return runs.holds(row); });
    if (found == groups.end()) {
      groups.push_back({row, {row}});
    } else {
      found->rows.push_back(row);
    }
  }
  return groups;
}

struct Figure {
  std::string name;
  double expected = 0.0;
  MeanError measured{};
  double tolerance = 0.0;           // 0: only shown
  bool has_counting_error = false;  // the error of `measured` is known, not only the scatter of the runs
};

void add_row(json& table, const Runs& runs, const Figure& figure) {
  const double error = figure.measured.mean / figure.expected - 1.0;
  const double sigma = figure.measured.sigma / figure.expected;
  const double tolerance = figure.tolerance * runs.ease;
  const bool knows_sigma = figure.has_counting_error || runs.rows.size() >= kMinRuns;
  const double allowed = knows_sigma ? std::max(tolerance, 3.0 * sigma) : tolerance;
  const bool has_sigma = runs.rows.size() > 1;
  const bool judged = tolerance > 0.0 && has_sigma && runs.first.at("method") == "exact";
  json row = {{"figure", figure.name},
              {"expected", number_or_null(figure.expected)},
              {"measured", number_or_null(figure.measured.mean)},
              {"error", number_or_null(error)},
              {"sigma", number_or_null(sigma)},
              {"allowed", number_or_null(tolerance)},
              {"seeds", runs.rows.size()},
              {"ns_per_disc_time", number_or_null(min_cost(runs))},
              {"verdict", !judged                       ? "-"
                          : std::fabs(error) <= allowed ? "pass"
                                                        : "FAIL"}};
  for (const char* key : {"device", "group", "case", "method", "displacement_per_step"})
    row[key] = runs.first.at(key);
  for (const char* key : {"area_fraction", "mach", "radius_over_path", "speed_ratio"}) {
    if (runs.first.contains(key)) row[key] = runs.first.at(key);
  }
  table.push_back(std::move(row));
}

void add_shock(json& table, const Runs& runs) {
  for (const char* name : {"density", "temperature", "pressure", "front_speed"}) {
    const double expected = runs.first.at(std::string(name) + "_theory").get<double>();
    add_row(table, runs, {name, expected, runs.mean_of(name), kShockTolerance});
  }
}

void add_blast(json& table, const Runs& runs) {
  const auto exponent = [](const json& row) { return blast_exponent(row.at("samples")); };
  const auto prefactor = [](const json& row) {
    return blast_slope(row.at("samples")) * row.at("theory").get<double>();
  };
  add_row(table, runs, {"exponent", 0.5, runs.mean(exponent), kBlastTolerance});
  add_row(table, runs, {"prefactor", runs.first.at("theory").get<double>(), runs.mean(prefactor)});
}

// Mean over the runs; its error is at least that of so many independent hits, which the scatter of a few runs
// may miss.
MeanError mean_drag(const Runs& runs) {
  MeanError drag = runs.mean_of("drag");
  double hits = 0.0;
  for (const json& row : runs.rows) hits += row.at("hits").get<double>();
  const double speed_ratio = runs.first.at("speed_ratio").get<double>();
  drag.sigma = std::max(drag.sigma, drag.mean * smooth_drag_error(speed_ratio, std::max(hits, 1.0)));
  return drag;
}

// The free-molecular limit is judged where it is one: without contacts, and where the path is 100 ball radii.
void add_drag(json& table, const Runs& runs) {
  const double speed_ratio = runs.first.at("speed_ratio").get<double>();
  const double radius = runs.first.at("radius_over_path").get<double>();
  add_row(table, runs,
          {"drag coefficient over free-molecular", theory::drag_specular(speed_ratio), mean_drag(runs),
           radius <= 0.01 ? kDragTolerance : 0.0, true});
  if (!runs.first.contains("stagnation_pressure")) return;
  const double area_fraction = runs.first.at("area_fraction").get<double>();
  const double mach = std::sqrt(2.0) * speed_ratio / theory::sound_speed(area_fraction);
  const bool is_steady = radius >= kMinJudgedRadius && runs.first.value("start", 0.0) >= kSettled;
  add_row(table, runs,
          {"pressure in front",
           theory::pressure_around_axis(theory::pitot_pressure_ratio(area_fraction, mach), kFrontHalfAngle),
           runs.mean_of("stagnation_pressure"), is_steady ? kStagnationTolerance : 0.0});
}

// The CPU's runs of a method in the layer: other devices have the same errors and only their own costs.
const json* layer_of_cpu(const std::vector<Runs>& all, const json& method, const json& displacement) {
  for (const Runs& runs : all) {
    const json& row = runs.first;
    if (row.at("group") == "layer" && row.at("device") == "cpu" && row.at("method") == method &&
        row.at("displacement_per_step") == displacement && row.contains("drag_sigma"))
      return &row;
  }
  return nullptr;
}

// A method's drag against that of `exact`, and what it costs on the device of these runs.
void add_layer(json& table, const Runs& runs, const std::vector<Runs>& all) {
  const json* exact = layer_of_cpu(all, "exact", 0.0);
  const json* measured = layer_of_cpu(all, runs.first.at("method"), runs.first.at("displacement_per_step"));
  if (exact == nullptr || measured == nullptr) return;
  const double sigma = measured->at("drag_sigma").get<double>();
  const double both = measured == exact ? sigma : std::hypot(sigma, exact->at("drag_sigma").get<double>());
  add_row(table, runs,
          {"drag coefficient", exact->at("drag").get<double>(), {measured->at("drag").get<double>(), both}});
  table.back()["seeds"] = measured->at("num_seeds");
}

// The layer as a table of `--accuracy`: rows as the ones of study work-precision, with the errors of drag.
json layer_table(const json& table) {
  json rows = json::array();
  for (const json& row : table) {
    if (row.at("group") != "layer") continue;
    const bool is_exact = row.at("method") == "exact";
    json error = is_exact ? reference_entry() : error_of(row.at("error"), row.at("sigma"));
    rows.push_back({{"group", "layer"},
                    {"device", row.at("device")},
                    {"area_fraction", 0.1},
                    {"restitution", 1.0},
                    {"method", row.at("method")},
                    {"displacement_per_step", row.at("displacement_per_step")},
                    {"ns_per_disc_time", row.at("ns_per_disc_time")},
                    {"errors", {{"drag", std::move(error)}}}});
  }
  mark_front(rows, "drag");
  return rows;
}

json table_of(const json& points, double ease) {
  json table = json::array();
  std::vector<Runs> all = grouped(points);
  for (Runs& runs : all) runs.ease = ease;
  for (const Runs& runs : all) {
    const std::string group = runs.first.at("group").get<std::string>();
    if (group == "shock") add_shock(table, runs);
    if (group == "blast") add_blast(table, runs);
    if (group == "drag") add_drag(table, runs);
    if (group == "layer") add_layer(table, runs, all);
  }
  return table;
}

std::string percent(const json& value) {
  return value.is_null() ? "-" : fmt::format("{:+.2f} %", 100.0 * value.get<double>());
}

std::string sentence(const json& row) {
  if (row.at("error").is_null() || row.at("sigma").is_null()) {
    return fmt::format("{}, {}, {}: {} was not measured, FAIL.", row.at("group").get<std::string>(),
                       row.at("case").get<std::string>(), row.at("method").get<std::string>(),
                       row.at("figure").get<std::string>());
  }
  return fmt::format("{}, {}, {}: {} {:.4g}, expected {:.4g}: {} +- {:.2f} %{}.",
                     row.at("group").get<std::string>(), row.at("case").get<std::string>(),
                     row.at("method").get<std::string>(), row.at("figure").get<std::string>(),
                     row.at("measured").get<double>(), row.at("expected").get<double>(),
                     percent(row.at("error")), 100.0 * row.at("sigma").get<double>(),
                     row.at("verdict") == "FAIL" ? ", FAIL" : "");
}

// The longest step such that it and all shorter ones are within 1 % of `exact`, or as near as the runs can
// tell.
std::string layer_sentence(const json& layer, const std::string& device, const std::string& method) {
  constexpr double kNear = 0.01;
  std::vector<json> rows;
  double exact_ns = NAN;
  for (const json& row : layer) {
    if (row.at("device") != device) continue;
    if (row.at("method") == "exact") exact_ns = row.at("ns_per_disc_time").get<double>();
    if (row.at("method") == method) rows.push_back(row);
  }
  const auto step_of = [](const json& row) { return row.at("displacement_per_step").get<double>(); };
  std::sort(rows.begin(), rows.end(), [&](const json& a, const json& b) { return step_of(a) < step_of(b); });
  json longest;
  for (const json& row : rows) {
    const json& error = row.at("errors").at("drag");
    const double allowed = std::max(kNear, 3.0 * error.at("sigma").get<double>());
    if (std::fabs(error.at("signed").get<double>()) > allowed) break;
    longest = row;
  }
  if (rows.empty()) return "";
  if (longest.is_null())
    return fmt::format("{}, layer: {} is off by more than 1 % at every step tried.", device, method);
  return fmt::format(
      "{}, layer: {} is within 1 % of exact, or cannot be told from it, up to {:g} diameters a step, at "
      "{:.2g} times its cost.",
      device, method, step_of(longest), longest.at("ns_per_disc_time").get<double>() / exact_ns);
}

}  // namespace

void conclude_gas_dynamics(json& result) {
  json failed = json::array(), words = json::array();
  // A quick run has few parcels and two seeds, whose scatter says little.
  constexpr double kQuickEase = 10.0;
  result["table"] = table_of(result.at("points"), result.value("quick", false) ? kQuickEase : 1.0);
  int num_judged = 0;
  for (const json& row : result["table"]) {
    if (row.at("verdict") == "-") continue;
    ++num_judged;
    words.push_back(sentence(row));
    if (row.at("verdict") == "FAIL") failed.push_back(sentence(row));
  }
  words.insert(words.begin(), fmt::format("{} of {} figures of exact are within the allowed error.",
                                          num_judged - static_cast<int>(failed.size()), num_judged));
  result["layer"] = layer_table(result["table"]);
  for (const char* device : {"cpu", "cuda"}) {
    for (const char* method : {"impulse", "spring"}) {
      const std::string layer = layer_sentence(result["layer"], device, method);
      if (!layer.empty()) words.push_back(layer);
    }
  }
  result["words"] = words;
  result["failed"] = failed;
}

}  // namespace pf
