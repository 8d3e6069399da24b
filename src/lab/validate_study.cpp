// The accuracy ladder as a study of the lab.
#include "lab/study.hpp"
#include "lab/validate.hpp"

namespace pf {
namespace {

using nlohmann::json;

std::vector<LabPoint> plan(const LabContext& context) {
  std::vector<LabPoint> points;
  for (Rung& rung : validation_rungs({context.quick})) {
    points.push_back({rung.key, [measure = std::move(rung.measure)] {
                        json rows = json::array();
                        measure([&rows](const ValidationRow& row) { rows.push_back(to_json(row)); });
                        return rows;
                      }});
  }
  return points;
}

void conclude(json& result) {
  json failed = json::array();
  for (const json& row : result.at("points")) {
    if (row.at("verdict") == "FAIL") failed.push_back(row.at("yardstick"));
  }
  result["failed"] = failed;
}

}  // namespace

Study validate_study() {
  return {"validate", "Against theory",
          "Every dot is one figure that theory or a published simulation gives: how far the program is off, "
          "as a share "
          "of what is allowed, with its statistical error. What lies between the dashed lines passes; "
          "impulse is shown "
          "and not judged.",
          plan, conclude};
}

}  // namespace pf
