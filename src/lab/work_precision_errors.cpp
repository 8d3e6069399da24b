#include "lab/work_precision_errors.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "core/portable_math.hpp"
#include "lab/mean_error.hpp"
#include "lab/theory.hpp"
#include "lab/work_precision_summary.hpp"

namespace pf {
namespace {

using nlohmann::json;

std::optional<double> number(const json& row, const char* key) {
  const auto found = row.find(key);
  if (found == row.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

json error_of(double error, double sigma) {
  const bool bound = std::fabs(error) < 2.0 * sigma;
  return {{"value", bound ? std::fabs(error) + 2.0 * sigma : std::fabs(error)},
          {"signed", error},
          {"sigma", sigma},
          {"bound", bound}};
}

std::string case_of(const json& row) {
  return row.at("device").get<std::string>() + "/" + row.at("group").get<std::string>() + "/" +
         row.at("area_fraction").dump() + "/" + row.at("restitution").dump();
}

// The row of `exact` with the shortest step, by case.
std::map<std::string, const json*> exact_rows(const json& points) {
  std::map<std::string, const json*> rows;
  for (const json& row : points) {
    if (row.at("method") != "exact") continue;
    const json*& kept = rows[case_of(row)];
    if (kept == nullptr || row.at("dt").get<double>() < kept->at("dt").get<double>()) kept = &row;
  }
  return rows;
}

// Relative error of a mean against another one, both with errors.
json against(const json& row, const json& truth, const char* key, double sigma, double truth_sigma) {
  const double t = *number(truth, key);
  const double relative_sigma = std::hypot(sigma, truth_sigma) / t;
  return error_of(*number(row, key) / t - 1.0, relative_sigma);
}

// A gas in equilibrium: theory is exact.
json elastic_errors(const json& row) {
  const double eta = *number(row, "area_fraction");
  const double rate = theory::collision_rate_per_s(eta, 1.0, 0.5), z = theory::compressibility(eta);
  return {
      {"rate", error_of(*number(row, "rate") / rate - 1.0, *number(row, "rate_sigma") / rate)},
      {"pressure",
       error_of(*number(row, "compressibility") / z - 1.0, *number(row, "compressibility_sigma") / z)},
      // Energy is counted, not sampled: per 10 collisions.
      {"energy", error_of((*number(row, "energy_ratio") - 1.0) * 10.0 / *number(row, "collisions"), 0.0)}};
}

// A cooling gas, against `exact`. Its blocks differ in truth, so errors are of counting: 1 / sqrt(events),
// for the pressure times 2 / sqrt(pi) (mean square over squared mean of the approach speed is 4 / pi).
json cooling_errors(const json& row, const json& truth) {
  const double events = 0.5 * *number(row, "collisions") * *number(row, "num_parcels");
  const double share = 1.0 / std::sqrt(std::max(1.0, events));
  const auto counted = [&](const char* key, double factor) {
    const double sigma = factor * share * *number(truth, key);
    return against(row, truth, key, sigma, sigma);
  };
  // Each collision takes (1 - e^2)/2 of the energy of a pair: the loss scatters as the count does.
  const double loss = -std::log(std::max(1e-300, *number(truth, "energy_ratio")));
  return {{"rate", counted("collisions", 1.0)},
          {"pressure", counted("compressibility", 2.0 / std::sqrt(kPi))},
          {"energy", error_of(*number(row, "energy_ratio") / *number(truth, "energy_ratio") - 1.0,
                              std::sqrt(2.0) * loss * share)}};
}

// Flights against those of `exact` from the same starts: mean over the seeds, so that chaos averages out.
// path: across the flight, relative to its length; drag: relative to the speed lost.
json ball_errors(const json& row, const json& truth) {
  const auto& start = row.at("start");
  std::vector<double> across, lost;
  double length = 0.0, true_loss = 0.0;
  const std::size_t num = std::min(row.at("ends").size(), truth.at("ends").size());
  for (std::size_t k = 0; k < num; ++k) {
    const json& end = row.at("ends")[k];
    const json& true_end = truth.at("ends")[k];
    across.push_back(end[1].get<double>() - true_end[1].get<double>());
    lost.push_back(true_end[2].get<double>() - end[2].get<double>());
    length += std::hypot(true_end[0].get<double>() - start[0].get<double>(),
                         true_end[1].get<double>() - start[1].get<double>()) /
              static_cast<double>(num);
    true_loss += (start[2].get<double>() - true_end[2].get<double>()) / static_cast<double>(num);
  }
  const MeanError path = mean_and_error(across), drag = mean_and_error(lost);
  return {{"path", error_of(path.mean / length, path.sigma / length)},
          {"drag", error_of(drag.mean / true_loss, drag.sigma / true_loss)}};
}

// The flights of `exact` are what the others are held against.
json yardstick() {
  const json none = {{"value", nullptr}, {"sigma", nullptr}, {"bound", false}, {"yardstick", true}};
  return {{"path", none}, {"drag", none}};
}

// Flights through air of their own, by number of parcels: scatter over the seeds, and how far their mean lies
// from that of the most parcels. No pairing here, each number has other starts.
json scatter_errors(const json& row, const json& points) {
  const json* most = nullptr;
  for (const json& other : points) {
    if (other.at("group") != "parcels" || !other.contains("ends")) continue;
    if (most == nullptr || other.at("num_parcels").get<double>() > most->at("num_parcels").get<double>())
      most = &other;
  }
  const auto column = [](const json& of, std::size_t k) {
    std::vector<double> values;
    for (const json& end : of.at("ends")) values.push_back(end[k].get<double>());
    return mean_and_error(values);
  };
  const json& start = row.at("start");
  const double length = column(*most, 0).mean - start[0].get<double>();
  const double loss = start[2].get<double>() - column(*most, 2).mean;
  const double num = static_cast<double>(row.at("ends").size());
  const auto entry = [&](std::size_t k, double scale) {
    const MeanError mine = column(row, k), best = column(*most, k);
    const double scatter = mine.sigma * std::sqrt(num) / scale, shift = (mine.mean - best.mean) / scale;
    const double shift_sigma = std::hypot(mine.sigma, best.sigma) / scale;
    // A shift within its statistical error is none that could be told.
    const double told = std::fabs(shift) > 2.0 * shift_sigma ? shift : 0.0;
    return json{{"value", std::hypot(scatter, told)},
                {"sigma", scatter / std::sqrt(2.0 * (num - 1.0))},
                {"bound", false},
                {"scatter", scatter},
                {"shift", shift},
                {"shift_sigma", shift_sigma}};
  };
  return {{"path", entry(1, length)}, {"drag", entry(2, loss)}};
}

json errors_of(const json& row, const json& points, const std::map<std::string, const json*>& truths) {
  const auto truth = truths.find(case_of(row));
  if (row.at("group") == "parcel-path") {
    const double value = *number(row, "path_error");
    return {{"parcel-path",
             {{"value", value},
              {"sigma", 0.25 * (*number(row, "path_high") - *number(row, "path_low"))},
              {"bound", false}}}};
  }
  if (row.at("group") == "parcels" && row.contains("ends")) return scatter_errors(row, points);
  if (row.at("group") != "ball" && row.at("restitution") == 1.0) return elastic_errors(row);
  if (truth == truths.end()) return json::object();
  if (row.at("group") == "gas") return cooling_errors(row, *truth->second);
  return row.at("method") == "exact" ? yardstick() : ball_errors(row, *truth->second);
}

// Marks what no other point of its case beats in both cost and error. Upper bounds take part as they are.
void mark_front(json& points, const std::string& error) {
  const auto value_of = [&](const json& row) {
    return number(row.at("errors").value(error, json::object()), "value");
  };
  for (json& row : points) {
    const std::optional<double> value = value_of(row), cost = number(row, "ns_per_disc_time");
    if (!value || !cost) continue;
    bool beaten = false;
    for (const json& other : points) {
      const std::optional<double> other_value = value_of(other),
                                  other_cost = number(other, "ns_per_disc_time");
      if (!other_value || !other_cost || case_of(other) != case_of(row)) continue;
      beaten = beaten || (*other_value <= *value && *other_cost < *cost) ||
               (*other_value < *value && *other_cost <= *cost);
    }
    row["errors"][error]["front"] = !beaten;
  }
}

// Least-squares slope of log error over log step, over the errors of 1e-5 to 0.1 diameters: what is above has
// left the regime of small steps, what is below is rounding.
json order_of(const std::vector<std::pair<double, double>>& points) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const auto& [step, error] : points) {
    if (error > 0.1 || error < 1e-5) continue;
    const double lx = std::log(step), ly = std::log(error);
    n += 1.0, x += lx, y += ly, xx += lx * lx, xy += lx * ly;
  }
  if (n < 3.0) return nullptr;
  return (n * xy - x * y) / (n * xx - x * x);
}

json orders(const json& points) {
  using Which = std::tuple<std::string, std::string, double>;  // device, method, area fraction
  std::map<Which, std::vector<std::pair<double, double>>> ladders;
  for (const json& row : points) {
    if (row.at("group") != "parcel-path" || row.at("method") == "exact") continue;
    ladders[{row.at("device"), row.at("method"), row.at("area_fraction")}].emplace_back(
        row.at("dt").get<double>(), row.at("path_error").get<double>());
  }
  json fitted = json::array();
  for (const auto& [which, ladder] : ladders) {
    const auto& [device, method, area_fraction] = which;
    fitted.push_back({{"device", device},
                      {"method", method},
                      {"area_fraction", area_fraction},
                      {"order", order_of(ladder)}});
  }
  return fitted;
}

}  // namespace

void conclude_work_precision(json& result) {
  json& points = result.at("points");
  const json measured = points;  // errors are worked out from the rows as they were measured
  const auto truths = exact_rows(measured);
  for (std::size_t k = 0; k < points.size(); ++k)
    points[k]["errors"] = errors_of(measured[k], measured, truths);
  for (const char* error : {"rate", "pressure", "energy", "path", "drag"}) mark_front(points, error);
  result["orders"] = orders(measured);
  result["words"] = work_precision_summary(result);
}

}  // namespace pf
