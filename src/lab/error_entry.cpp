#include "lab/error_entry.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace pf {

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

json reference_entry() {
  return {{"value", nullptr}, {"sigma", nullptr}, {"bound", false}, {"yardstick", true}};
}

std::string case_of(const json& row) {
  return row.at("device").get<std::string>() + "/" + row.at("group").get<std::string>() + "/" +
         row.at("area_fraction").dump() + "/" + row.at("restitution").dump();
}

void mark_front(json& rows, const std::string& error) {
  const auto value_of = [&](const json& row) {
    return number(row.at("errors").value(error, json::object()), "value");
  };
  for (json& row : rows) {
    const std::optional<double> value = value_of(row), cost = number(row, "ns_per_disc_time");
    if (!value || !cost) continue;
    bool beaten = false;
    for (const json& other : rows) {
      const std::optional<double> other_value = value_of(other),
                                  other_cost = number(other, "ns_per_disc_time");
      if (!other_value || !other_cost || case_of(other) != case_of(row)) continue;
      beaten = beaten || (*other_value <= *value && *other_cost < *cost) ||
               (*other_value < *value && *other_cost <= *cost);
    }
    row["errors"][error]["front"] = !beaten;
  }
}

}  // namespace pf
