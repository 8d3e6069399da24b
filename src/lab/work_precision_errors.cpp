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
#include "lab/error_entry.hpp"
#include "lab/line_fit.hpp"
#include "lab/mean_error.hpp"
#include "lab/theory.hpp"
#include "lab/work_precision_summary.hpp"

namespace pf {
namespace {

using nlohmann::json;

// Throws json::exception if it is missing: a file of results may be edited.
double figure(const json& row, const char* key) { return row.at(key).get<double>(); }

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

// Relative error of a mean against that of the reference. sigma: standard error of both.
json relative_error(const json& row, const json& reference, const char* key, double sigma) {
  const double expected = figure(reference, key);
  const double relative_sigma = std::hypot(sigma, sigma) / expected;
  return error_of(figure(row, key) / expected - 1.0, relative_sigma);
}

// A gas in equilibrium against theory, which is exact.
json elastic_errors(const json& row) {
  const double eta = figure(row, "area_fraction");
  const double rate = theory::collision_rate_per_s(eta, 1.0, 0.5), z = theory::compressibility(eta);
  return {{"rate", error_of(figure(row, "rate") / rate - 1.0, figure(row, "rate_sigma") / rate)},
          {"pressure",
           error_of(figure(row, "compressibility") / z - 1.0, figure(row, "compressibility_sigma") / z)},
          // Per 10 collisions. Energy has no statistical error.
          {"energy", error_of((figure(row, "energy_ratio") - 1.0) * 10.0 / figure(row, "collisions"), 0.0)}};
}

// A cooling gas against `exact`. The rate is that over the thermal speed of the moment: a method that misses
// collisions keeps the gas hotter, so that their number recovers. Blocks differ systematically, so that
// errors are those of counting: 1 / sqrt(events), for the pressure times 2 / sqrt(pi) (mean square over
// squared mean of the closing speed is 4 / pi).
json cooling_errors(const json& row, const json& reference) {
  const double events = 0.5 * figure(row, "collisions") * figure(row, "num_parcels");
  const double share = 1.0 / std::sqrt(std::max(1.0, events));
  // Of the pressure only what collisions add scatters.
  const double excess = figure(reference, "compressibility") - 1.0;
  // Each collision takes (1 - e^2)/2 of the energy of a pair: the loss scatters like the count.
  const double loss = -std::log(std::max(1e-300, figure(reference, "energy_ratio")));
  return {
      {"rate", relative_error(row, reference, "rate", share * figure(reference, "rate"))},
      {"pressure", relative_error(row, reference, "compressibility", 2.0 / std::sqrt(kPi) * share * excess)},
      {"energy", error_of(figure(row, "energy_ratio") / figure(reference, "energy_ratio") - 1.0,
                          std::sqrt(2.0) * loss * share)}};
}

// Flights against those of `exact` from the same starts. The mean over the seeds averages out chaos. path:
// across the flight, relative to its length; drag: relative to the loss of speed.
json ball_errors(const json& row, const json& reference) {
  const auto& start = row.at("start");
  std::vector<double> across, lost;
  double length = 0.0, expected_loss = 0.0;
  const std::size_t num = std::min(row.at("ends").size(), reference.at("ends").size());
  for (std::size_t k = 0; k < num; ++k) {
    const json& end = row.at("ends")[k];
    const json& expected_end = reference.at("ends")[k];
    across.push_back(end[1].get<double>() - expected_end[1].get<double>());
    lost.push_back(expected_end[2].get<double>() - end[2].get<double>());
    length += std::hypot(expected_end[0].get<double>() - start[0].get<double>(),
                         expected_end[1].get<double>() - start[1].get<double>()) /
              static_cast<double>(num);
    expected_loss += (start[2].get<double>() - expected_end[2].get<double>()) / static_cast<double>(num);
  }
  const MeanError path = mean_and_error(across), drag = mean_and_error(lost);
  return {{"path", error_of(path.mean / length, path.sigma / length)},
          {"drag", error_of(drag.mean / expected_loss, drag.sigma / expected_loss)}};
}

// Column k of the ends of flights: 0 and 1 the place, 2 the speed.
MeanError mean_end(const json& row, std::size_t k) {
  return mean_of_each(row.at("ends"), [k](const json& end) { return end[k].get<double>(); });
}

// Flights of numbers of parcels, the smallest first.
std::vector<const json*> flights_by_number(const json& points) {
  std::vector<const json*> flights;
  for (const json& row : points) {
    if (row.at("group") == "parcels" && row.contains("ends")) flights.push_back(&row);
  }
  std::ranges::sort(flights, {}, [](const json* row) { return figure(*row, "num_parcels"); });
  return flights;
}

// Weights of the means of each number in the limit of infinitely many parcels: the two largest numbers give
// it, since what is missing falls with 1 / sqrt(N).
std::vector<double> weights_in_limit(const std::vector<const json*>& flights) {
  std::vector<double> weights(flights.size(), 0.0);
  weights.back() = 1.0;
  if (flights.size() < 2) return weights;
  const std::size_t last = flights.size() - 1;
  const double ratio = figure(*flights[last], "num_parcels") / figure(*flights[last - 1], "num_parcels");
  const double share = 1.0 / (std::sqrt(ratio) - 1.0);
  weights[last] = 1.0 + share;
  weights[last - 1] = -share;
  return weights;
}

// The sum of the mean ends of flights with these weights.
MeanError weighted_end(const std::vector<const json*>& flights, const std::vector<double>& weights,
                       std::size_t k) {
  MeanError sum{0.0, 0.0};
  for (std::size_t f = 0; f < flights.size(); ++f) {
    const MeanError mean = mean_end(*flights[f], k);
    sum.mean += weights[f] * mean.mean;
    sum.sigma = std::hypot(sum.sigma, weights[f] * mean.sigma);
  }
  return sum;
}

// Flights of one number of parcels: scatter over the seeds, and distance of their mean from the limit of many
// parcels. Seeds are not paired, since each number has other starts.
json scatter_errors(const json& row, const json& points) {
  const std::vector<const json*> flights = flights_by_number(points);
  const std::vector<double> in_limit = weights_in_limit(flights);
  std::vector<double> in_shift;  // of this number's mean and the limit, which may have a part in common
  for (std::size_t f = 0; f < flights.size(); ++f)
    in_shift.push_back((flights[f] == &row ? 1.0 : 0.0) - in_limit[f]);
  const json& start = row.at("start");
  const double length = weighted_end(flights, in_limit, 0).mean - start[0].get<double>();
  const double loss = start[2].get<double>() - weighted_end(flights, in_limit, 2).mean;
  const double num = static_cast<double>(row.at("ends").size());
  const auto entry = [&](std::size_t k, double scale) {
    const MeanError from_limit = weighted_end(flights, in_shift, k);
    const double scatter = mean_end(row, k).sigma * std::sqrt(num) / scale;
    const double shift = from_limit.mean / scale, shift_sigma = from_limit.sigma / scale;
    // A shift within its statistical error is not resolved and counts as none.
    const double resolved = std::fabs(shift) > 2.0 * shift_sigma ? shift : 0.0;
    return json{{"value", std::hypot(scatter, resolved)},
                {"sigma", scatter / std::sqrt(2.0 * (num - 1.0))},
                {"bound", false},
                {"scatter", scatter},
                {"shift", shift},
                {"shift_sigma", shift_sigma}};
  };
  return {{"path", entry(1, length)}, {"drag", entry(2, loss)}};
}

json errors_of(const json& row, const json& points, const std::map<std::string, const json*>& references) {
  const auto reference = references.find(case_of(row));
  if (row.at("group") == "parcel-path") {
    const double value = figure(row, "path_error");
    return {{"parcel-path",
             {{"value", value},
              {"sigma", 0.25 * (figure(row, "path_high") - figure(row, "path_low"))},
              {"bound", false}}}};
  }
  if (row.at("group") == "parcels" && row.contains("ends")) return scatter_errors(row, points);
  if (row.at("group") != "ball" && row.at("restitution") == 1.0) return elastic_errors(row);
  if (reference == references.end()) return json::object();
  json errors = row.at("group") == "gas" ? cooling_errors(row, *reference->second)
                                         : ball_errors(row, *reference->second);
  if (row.at("method") == "exact")
    for (json& error : errors) error = reference_entry();
  return errors;
}

// Least-squares slope of log error over log step, for errors of 1e-5 to 0.1 diameters. Larger errors are
// outside the regime of small steps; smaller ones are rounding.
json order_of(const std::vector<std::pair<double, double>>& points) {
  LineFit fit;
  for (const auto& [step, error] : points) {
    if (error <= 0.1 && error >= 1e-5) fit.add(std::log(step), std::log(error));
  }
  return fit.num() < 3.0 ? json(nullptr) : json(fit.slope());
}

json orders(const json& points) {
  using Ladder = std::tuple<std::string, std::string, double>;  // device, method, area fraction
  std::map<Ladder, std::vector<std::pair<double, double>>> ladders;
  for (const json& row : points) {
    if (row.at("group") != "parcel-path" || row.at("method") == "exact") continue;
    ladders[{row.at("device"), row.at("method"), row.at("area_fraction")}].emplace_back(
        row.at("dt").get<double>(), row.at("path_error").get<double>());
  }
  json fitted = json::array();
  for (const auto& [ladder, steps] : ladders) {
    const auto& [device, method, area_fraction] = ladder;
    fitted.push_back({{"device", device},
                      {"method", method},
                      {"area_fraction", area_fraction},
                      {"order", order_of(steps)}});
  }
  return fitted;
}

}  // namespace

void conclude_work_precision(json& result) {
  json& points = result.at("points");
  const json measured = points;  // errors follow from the rows without errors
  const auto references = exact_rows(measured);
  for (std::size_t k = 0; k < points.size(); ++k)
    points[k]["errors"] = errors_of(measured[k], measured, references);
  for (const char* error : {"rate", "pressure", "energy", "path", "drag"}) mark_front(points, error);
  result["orders"] = orders(measured);
  result["words"] = work_precision_summary(result);
}

}  // namespace pf
