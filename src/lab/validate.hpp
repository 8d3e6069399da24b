// Validation against figures that theory or a published simulation gives. They are measured with method
// `exact`, and where the comparison tells something with `impulse` beside it.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/settings.hpp"

namespace pf {

struct ValidationRow {
  std::string reference;  // the figure, with its source
  Method method = Method::exact;
  double expected = 0.0;
  double measured = 0.0;
  double sigma = 0.0;      // statistical error of `measured`; 0: none
  double tolerance = 0.0;  // allowed |measured - expected|, if 3 sigma is less
  bool relative = true;    // error and tolerance are relative to `expected`
  bool judged = true;      // false for `impulse`, which is only shown
  double seconds = 0.0;    // wall clock

  double error() const;           // relative or absolute, by `relative`
  double error_of_error() const;  // sigma in the unit of error()
  bool passed() const;            // |error| <= max(3 sigma, tolerance)
  std::string verdict() const;    // "pass", "FAIL" or "-"
};

struct ValidationPlan {
  bool quick = false;  // a hundredth of the events: seconds instead of minutes, 0.3 % instead of 0.1 %

  double amount(double full, double in_quick) const { return quick ? in_quick : full; }
  double tolerance() const { return quick ? 3e-3 : 1e-3; }
};

// Receives each row when it is finished.
using RowSink = std::function<void(const ValidationRow&)>;

// One measurement: a row, or several rows of the same run.
struct ValidationCase {
  std::string key;  // unique
  std::function<void(const RowSink& add)> measure;
};

std::vector<ValidationCase> pair_cases(const ValidationPlan& plan);
std::vector<ValidationCase> gas_cases(const ValidationPlan& plan);
std::vector<ValidationCase> relaxation_cases(const ValidationPlan& plan);
std::vector<ValidationCase> ball_cases(const ValidationPlan& plan);
// All cases, from two bodies to a ball in a stream.
std::vector<ValidationCase> validation_cases(const ValidationPlan& plan);

// Measures all cases; `add` receives each row.
std::vector<ValidationRow> run_validation(const ValidationPlan& plan, const RowSink& add);

// The head and a line of the printed table.
std::string table_head();
std::string table_line(const ValidationRow& row);
nlohmann::json to_json(const ValidationRow& row);
nlohmann::json to_json(const std::vector<ValidationRow>& rows, const ValidationPlan& plan);

}  // namespace pf
