// A study of the lab: a list of points, each measured on its own, and the conclusions from all of them.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "backend/backend.hpp"

namespace pf {

// A device that takes steps. Its name is the name of its series in tables and charts.
struct LabDevice {
  std::string name;  // "cpu" or "cuda"
  std::function<std::unique_ptr<Backend>()> make;
};

struct LabContext {
  bool quick = false;              // fewer parcels, shorter runs: minutes on 2 cores
  std::vector<LabDevice> devices;  // the CPU first
  std::string scene = "court";     // for study `terms`
};

struct LabPoint {
  std::string key;  // name in the table; --resume finds finished points by it
  // Returns a row of the table, an object of numbers and texts; or an array of rows.
  std::function<nlohmann::json()> measure;
  bool is_timing = false;  // runs alone, after the others
};

struct Study {
  std::string name;
  std::string title;
  std::string reading;  // two sentences on how to read its figure
  std::vector<LabPoint> (*plan)(const LabContext& context);
  // Adds errors, orders and verdicts to the result. Called after the last point, also of a run that was
  // stopped. Each of result["points"] is a row of measure() with its "key". Names of references that the
  // result disagrees with go into result["failed"], a summary into result["words"], a list of sentences.
  void (*conclude)(nlohmann::json& result);
  // Points use one thread each and, but for those that say so, are no timings: the machine measures several
  // at a time.
  bool runs_in_parallel = false;
  bool has_device_series = false;  // measures each device of the context, not the CPU alone
};

Study work_precision_study();
Study stability_study();
Study contact_clock_study();
Study terms_study();
Study gas_dynamics_study();
Study validate_study();

// All studies, in the order of `lab all`.
const std::vector<Study>& studies();

}  // namespace pf
