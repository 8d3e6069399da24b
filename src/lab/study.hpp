// A study of the lab: a list of points, each measured on its own, and what is concluded from all of them.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "backend/backend.hpp"

namespace pf {

// Where steps are taken. Its name is the name of the series in tables and charts.
struct LabDevice {
  std::string name;  // "cpu" or "cuda"
  std::function<std::unique_ptr<Backend>()> make;
};

struct LabContext {
  bool quick = false;              // fewer parcels, shorter runs: minutes on 2 cores
  std::vector<LabDevice> devices;  // the CPU first
  std::string scene = "court";     // of the study of terms
};

struct LabPoint {
  std::string key;  // names the point in the table; --resume goes by it
  // An object of numbers and texts, a row of the table; or an array of such.
  std::function<nlohmann::json()> measure;
};

struct Study {
  std::string name;
  std::string title;
  std::string reading;  // two sentences: how to read its figure
  std::vector<LabPoint> (*plan)(const LabContext& context);
  // Adds to the result what follows from all its points: errors, orders, verdicts. Called after every point,
  // also when some are missing. Each of result["points"] is a row that measure() returned, with its "key".
  // Yardsticks that were not met go into result["failed"], what it says in plain words into result["words"],
  // a list of sentences.
  void (*conclude)(nlohmann::json& result);
  // Its points are no timings and of one thread each: as many at once as the machine has threads.
  bool parallel_for = false;
};

Study work_precision_study();
Study stability_study();
Study terms_study();
Study validate_study();

// All studies, in the order of `lab all`.
const std::vector<Study>& studies();

}  // namespace pf
