#include "lab/contact_clock_shifts.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lab/mean_error.hpp"

namespace pf {
namespace {

using nlohmann::json;

// Values of one column of the runs, by seed.
template <class Get>
std::vector<double> values_of(const json& row, Get get) {
  std::vector<double> values;
  for (const json& run : row.at("runs")) values.push_back(get(run));
  return values;
}

// Mean difference of runs with the same seed over the mean without a contact duration.
template <class Get>
void add_shift(json& row, const json& without, const char* name, Get get) {
  std::vector<double> with = values_of(row, get);
  const std::vector<double> base = values_of(without, get);
  const double mean = mean_and_error(base).mean;
  with.resize(std::min(with.size(), base.size()));
  for (std::size_t k = 0; k < with.size(); ++k) with[k] = (with[k] - base[k]) / mean;
  const MeanError shift = mean_and_error(with);
  row[name] = shift.mean;
  row[std::string(name) + "_sigma"] = shift.sigma;
}

void add_shifts(json& row, const json& without) {
  const auto column = [](std::size_t k) { return [k](const json& run) { return run[k].get<double>(); }; };
  if (row.at("case") == "gas") {
    add_shift(row, without, "rate", column(0));
    add_shift(row, without, "energy", column(1));
    return;
  }
  const auto path = [](const json& run) { return std::hypot(run[0].get<double>(), run[1].get<double>()); };
  add_shift(row, without, "path", path);
  add_shift(row, without, "drag", column(2));
  row["collisions"] = mean_and_error(values_of(row, column(3))).mean;
}

}  // namespace

void conclude_contact_clock(json& result) {
  const json points = result.at("points");
  for (json& row : result["points"]) {
    const auto without = std::find_if(points.begin(), points.end(), [&](const json& other) {
      return other.at("clock") == 0.0 && other.at("case") == row.at("case") &&
             other.at("restitution") == row.at("restitution");
    });
    if (without != points.end()) add_shifts(row, *without);
  }
}

}  // namespace pf
