// The accuracy ladder: yardsticks that theory, or a published simulation, gives in figures, measured with
// method `exact`, and with `impulse` beside it where that says something.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/settings.hpp"

namespace pf {

struct ValidationRow {
  std::string yardstick;
  Method method = Method::exact;
  double expected = 0.0;
  double measured = 0.0;
  double sigma = 0.0;      // statistical error of measured; 0: none
  double tolerance = 0.0;  // of |measured - expected| beside 3 sigma
  bool relative = true;    // error and tolerance are relative to expected
  bool judged = true;      // `impulse` is shown, not judged
  double seconds = 0.0;    // wall clock

  double error() const;           // relative or absolute, as `relative` says
  double error_of_error() const;  // sigma in the same measure
  bool passed() const;            // |error| <= max(3 sigma, tolerance)
  std::string verdict() const;    // "pass", "FAIL" or "-"
};

struct ValidationPlan {
  bool quick = false;    // a hundredth of the events: minutes become seconds, 0.1 % become 0.3 %
  unsigned threads = 0;  // that runs of one thread each are spread over; 0: all of the machine

  // How many of something: `full` of them, or `quick`.
  double amount(double full, double in_quick) const { return quick ? in_quick : full; }
  double tolerance() const { return quick ? 3e-3 : 1e-3; }
};

// Takes finished rows as they come.
using RowSink = std::function<void(const ValidationRow&)>;

// One measurement: a row, or some that come of the same run.
struct ValidationCase {
  std::string key;  // names it among all
  std::function<void(const RowSink& add)> measure;
};

std::vector<ValidationCase> pair_rungs(const ValidationPlan& plan);
std::vector<ValidationCase> gas_rungs(const ValidationPlan& plan);
std::vector<ValidationCase> relaxation_rungs(const ValidationPlan& plan);
std::vector<ValidationCase> ball_rungs(const ValidationPlan& plan);
// The whole ladder, from the bottom.
std::vector<ValidationCase> validation_rungs(const ValidationPlan& plan);

std::vector<ValidationRow> run_validation(const ValidationPlan& plan, const RowSink& add);

// A line of the table, and its head.
std::string table_head();
std::string table_line(const ValidationRow& row);
nlohmann::json to_json(const ValidationRow& row);
nlohmann::json to_json(const std::vector<ValidationRow>& rows, const ValidationPlan& plan);

}  // namespace pf
