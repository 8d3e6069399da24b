// Validation as a study of the lab.
#include <fmt/format.h>

#include "lab/study.hpp"
#include "lab/validate.hpp"

namespace pf {
namespace {

using nlohmann::json;

std::vector<LabPoint> plan_validation(const LabContext& context) {
  std::vector<LabPoint> points;
  for (ValidationCase& validation : validation_cases({context.quick})) {
    points.push_back({validation.key, [measure = std::move(validation.measure)] {
                        json rows = json::array();
                        measure([&rows](const ValidationRow& row) { rows.push_back(to_json(row)); });
                        return rows;
                      }});
  }
  return points;
}

void conclude(json& result) {
  json failed = json::array();
  int num_judged = 0;
  for (const json& row : result.at("points")) {
    if (row.at("judged").get<bool>()) ++num_judged;
    if (row.at("verdict") == "FAIL") failed.push_back(row.at("yardstick"));
  }
  const auto num_failed = static_cast<int>(failed.size());
  result["words"] = {fmt::format("{} of {} figures of exact are within the allowed error.",
                                 num_judged - num_failed, num_judged)};
  result["failed"] = failed;
}

}  // namespace

Study validate_study() {
  return {
      "validate", "Against theory",
      "Each dot is the program's error in one figure that theory or a published simulation gives, over the "
      "allowed error, with its statistical error. Dots between the dashed lines pass; impulse is shown "
      "and not judged.",
      plan_validation, conclude};
}

}  // namespace pf
