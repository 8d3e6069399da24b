#include "lab/work_precision_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "app/accuracy_table.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr double kMaxError = 0.2;  // relative; a larger error is no result

struct Step {
  double dt, error, cost;
};

// One method's steps in one case, shortest first.
using Ladder = std::vector<Step>;
using Ladders = std::map<std::string, Ladder>;  // by method

bool is_of(const json& row, const std::string& device, const std::string& error) {
  return row.at("device") == device && row.at("group") == (needs_ball(error) ? "ball" : "gas") &&
         row.contains("errors") && row["errors"].contains(error);
}

// Ladders of one restitution, by area fraction.
std::map<double, Ladders> cases_of(const json& points, const std::string& device, const std::string& error) {
  double restitution = 1.0;
  for (const json& row : points) {
    if (needs_ball(error) && is_of(row, device, error))
      restitution = std::min(restitution, row.at("restitution").get<double>());
  }
  std::map<double, Ladders> cases;
  for (const json& row : points) {
    if (!is_of(row, device, error) || row.at("restitution") != restitution) continue;
    const json& value = row["errors"][error].at("value");
    const bool is_exact = row.at("method") == "exact";
    if ((!is_exact && !value.is_number()) || !row.at("ns_per_disc_time").is_number()) continue;
    cases[row.at("area_fraction")][row.at("method")].push_back(
        {row.at("dt"), is_exact ? 0.0 : value.get<double>(), row.at("ns_per_disc_time")});
  }
  for (auto& [area_fraction, ladders] : cases) {
    for (auto& [method, ladder] : ladders) {
      std::sort(ladder.begin(), ladder.end(), [](const Step& a, const Step& b) { return a.dt < b.dt; });
    }
  }
  return cases;
}

// Cost of the cheapest step that reaches the error with all shorter ones; infinite if there is none.
double cost_at(const Ladder& ladder, double error) {
  double cost = INFINITY;
  for (const Step& step : ladder) {
    if (step.error > error) break;
    cost = std::min(cost, step.cost);
  }
  return cost;
}

// Errors for which one method is the cheapest.
struct Range {
  std::string method;
  double from, to;
};

std::vector<Range> cheapest(const Ladders& ladders) {
  std::set<double> errors = {0.0};
  for (const auto& [method, ladder] : ladders) {
    for (const Step& step : ladder) {
      if (step.error < kMaxError) errors.insert(step.error);
    }
  }
  std::vector<Range> ranges;
  for (const double error : errors) {
    std::string best;
    double min_cost = INFINITY;
    for (const auto& [method, ladder] : ladders) {
      const double cost = cost_at(ladder, error);
      if (cost < min_cost) best = method, min_cost = cost;
    }
    if (best.empty()) continue;
    if (!ranges.empty()) ranges.back().to = error;
    if (ranges.empty() || ranges.back().method != best) ranges.push_back({best, error, kMaxError});
    ranges.back().to = kMaxError;
  }
  return ranges;
}

std::string percent(double error) { return fmt::format("{:.2g} %", 100.0 * error); }

// "area fraction 0.2: exact below 1.5 %, then impulse".
std::string place_text(double area_fraction, const std::vector<Range>& ranges) {
  std::vector<std::string> parts;
  for (const Range& range : ranges) {
    const bool is_first = range.from == 0.0, is_last = range.to == kMaxError;
    parts.push_back((is_first ? "" : "then ") + range.method +
                    (is_last    ? ""
                     : is_first ? " below " + percent(range.to)
                                : " up to " + percent(range.to)));
  }
  return fmt::format("area fraction {:g}: {}", area_fraction, fmt::join(parts, ", "));
}

std::string sentence(const std::string& device, const std::string& name,
                     const std::map<double, Ladders>& cases) {
  std::vector<std::string> places, never = {"exact", "impulse", "spring"};
  for (const auto& [area_fraction, ladders] : cases) {
    const std::vector<Range> ranges = cheapest(ladders);
    places.push_back(place_text(area_fraction, ranges));
    for (const Range& range : ranges) std::erase(never, range.method);
  }
  const std::string rest =
      never.empty() ? "" : fmt::format("; {} never up to {}", fmt::join(never, " and "), percent(kMaxError));
  return fmt::format("{}, cheapest for an error of {} by {}{}.", device, name, fmt::join(places, "; "), rest);
}

std::string orders_sentence(const json& orders, const std::string& device) {
  std::vector<std::string> parts;
  for (const json& entry : orders) {
    if (entry.at("device") != device || !entry.at("order").is_number()) continue;
    parts.push_back(fmt::format("{:.2f} for {} at area fraction {:g}", entry["order"].get<double>(),
                                entry.at("method").get<std::string>(),
                                entry.at("area_fraction").get<double>()));
  }
  return parts.empty()
             ? ""
             : fmt::format("{}, order of convergence of parcels' paths: {}.", device, fmt::join(parts, ", "));
}

}  // namespace

json work_precision_summary(const json& result) {
  const json& points = result.at("points");
  std::vector<std::string> devices;
  for (const json& row : points) {
    const std::string device = row.at("device");
    if (std::find(devices.begin(), devices.end(), device) == devices.end()) devices.push_back(device);
  }
  constexpr const char* kNames[][2] = {{"rate", "the collision rate"},
                                       {"pressure", "the pressure"},
                                       {"path", "the ball's path"},
                                       {"drag", "the ball's drag"}};
  json sentences = json::array();
  for (const std::string& device : devices) {
    for (const auto& [error, name] : kNames) {
      const auto cases = cases_of(points, device, error);
      if (!cases.empty()) sentences.push_back(sentence(device, name, cases));
    }
    const std::string orders = orders_sentence(result.at("orders"), device);
    if (!orders.empty()) sentences.push_back(orders);
  }
  return sentences;
}

}  // namespace pf
