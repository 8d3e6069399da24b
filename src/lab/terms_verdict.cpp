#include "lab/terms_verdict.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "lab/mean_error.hpp"

namespace pf {
namespace {

using nlohmann::json;

// Mean difference of flights with the same seed.
template <class Get>
MeanError difference(const json& flights, const json& full, Get get) {
  std::vector<double> values;
  for (std::size_t k = 0; k < std::min(flights.size(), full.size()); ++k) {
    values.push_back(get(flights[k]) - get(full[k]));
  }
  return mean_and_error(values);
}

template <class Get>
double mean(const json& flights, Get get) {
  double sum = 0.0;
  for (const json& flight : flights) sum += get(flight);
  return sum / static_cast<double>(flights.size());
}

const char* verdict(double shift, double sigma) {
  if (shift - 2.0 * sigma > kTermTolerance) return "keep";
  return shift + 2.0 * sigma <= kTermTolerance ? "leave out" : "not resolved";
}

const char* worse(const char* a, const char* b) {
  const auto rank = [](const std::string& text) {
    return text == "keep" ? 2 : text == "not resolved" ? 1 : 0;
  };
  return rank(a) >= rank(b) ? a : b;
}

// Adds the share of the cost that a flight without the term saves, over the flights that were timed, if both
// were timed on the same device.
void add_saved_share(const json& full, json& variant) {
  variant["saved_share"] = variant["saved_share_sigma"] = nullptr;
  if (variant.value("timed_on", "") != full.value("timed_on", "")) return;
  const json& without = variant.at("timed_ms_per_simulated_s");
  const json& with = full.at("timed_ms_per_simulated_s");
  std::vector<double> shares;
  for (std::size_t k = 0; k < std::min(without.size(), with.size()); ++k)
    shares.push_back(1.0 - without[k].get<double>() / with[k].get<double>());
  const MeanError saved = mean_and_error(shares);
  variant["saved_share"] = saved.mean;
  variant["saved_share_sigma"] = saved.sigma;
}

}  // namespace

void conclude_terms(json& result) {
  result["tolerance"] = kTermTolerance;
  json& points = result.at("points");
  if (points.empty() || points[0].at("term") != "") return;
  const json full = points[0];
  const json& flights = full.at("flights");
  const auto column = [](std::size_t k) {
    return [k](const json& flight) { return flight[k].get<double>(); };
  };
  const double length = mean(flights, column(4)), speed = mean(flights, column(2));
  const double vx = full.at("direction")[0], vy = full.at("direction")[1], v = std::hypot(vx, vy);
  for (json& row : points) {
    if (row.at("term") == "") continue;
    const json& variant = row.at("flights");
    const MeanError x = difference(variant, flights, column(0)), y = difference(variant, flights, column(1));
    const MeanError faster = difference(variant, flights, column(2));
    row["exit_shift"] = std::hypot(x.mean, y.mean) / length;
    row["exit_shift_sigma"] = std::hypot(x.sigma, y.sigma) / length;
    row["deflection_m"] = (y.mean * vx - x.mean * vy) / v;
    row["speed_shift"] = faster.mean / speed;
    row["speed_shift_sigma"] = faster.sigma / speed;
    add_saved_share(full, row);
    row["verdict"] = worse(verdict(row["exit_shift"], row["exit_shift_sigma"]),
                           verdict(std::fabs(faster.mean) / speed, row["speed_shift_sigma"]));
  }
}

}  // namespace pf
