#include "lab/validate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "lab/gas_case.hpp"

namespace pf {

double ValidationRow::error() const {
  const double off = measured - expected;
  return relative ? off / std::fabs(expected) : off;
}

double ValidationRow::error_of_error() const { return relative ? sigma / std::fabs(expected) : sigma; }

bool ValidationRow::passed() const {
  return std::fabs(error()) <= std::max(3.0 * error_of_error(), tolerance);  // false for NaN
}

std::string ValidationRow::verdict() const { return !judged ? "-" : passed() ? "pass" : "FAIL"; }

std::vector<ValidationRow> run_validation(const ValidationPlan& plan, const RowSink& add) {
  std::vector<ValidationRow> rows;
  const RowSink both = [&](const ValidationRow& row) {
    rows.push_back(row);
    add(row);
  };
  for (const ValidationCase& validation : validation_cases(plan)) validation.measure(both);
  return rows;
}

std::vector<ValidationCase> validation_cases(const ValidationPlan& plan) {
  std::vector<ValidationCase> all;
  for (const auto cases_of : {pair_cases, gas_cases, relaxation_cases, ball_cases}) {
    for (ValidationCase& validation : cases_of(plan)) all.push_back(std::move(validation));
  }
  return all;
}

std::string table_head() {
  return fmt::format("{:<46} {:<8} {:>13} {:>13} {:>10} {:>9} {:>9} {:>7} {}", "reference", "method",
                     "expected", "measured", "error", "sigma", "allowed", "time", "verdict");
}

std::string table_line(const ValidationRow& row) {
  const auto size = [&](double x) {
    return row.relative ? fmt::format("{:.3f} %", 100.0 * x) : fmt::format("{:.2g}", x);
  };
  const double allowed = std::max(3.0 * row.error_of_error(), row.tolerance);
  return fmt::format("{:<46} {:<8} {:>13.6g} {:>13.6g} {:>10} {:>9} {:>9} {:>5.1f} s {}", row.reference,
                     method_name(row.method), row.expected, row.measured, size(row.error()),
                     row.sigma > 0.0 ? size(row.error_of_error()) : "", row.judged ? size(allowed) : "",
                     row.seconds, row.verdict());
}

nlohmann::json to_json(const ValidationRow& row) {
  return {{"yardstick", row.reference}, {"method", method_name(row.method)},
          {"expected", row.expected},   {"measured", row.measured},
          {"error", row.error()},       {"sigma", row.error_of_error()},
          {"relative", row.relative},   {"tolerance", row.tolerance},
          {"judged", row.judged},       {"verdict", row.verdict()},
          {"seconds", row.seconds}};
}

nlohmann::json to_json(const std::vector<ValidationRow>& rows, const ValidationPlan& plan) {
  nlohmann::json list = nlohmann::json::array();
  for (const ValidationRow& row : rows) list.push_back(to_json(row));
  const bool all = std::all_of(rows.begin(), rows.end(),
                               [](const ValidationRow& row) { return !row.judged || row.passed(); });
  return {{"study", "validate"}, {"quick", plan.quick}, {"passed", all}, {"rows", list}};
}

}  // namespace pf
