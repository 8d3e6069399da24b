// Errors in a study's rows, as charts and `--accuracy` read them.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace pf {

// A number of a row; empty if it is missing or null.
std::optional<double> number(const nlohmann::json& row, const char* key);

// {"value", "signed", "sigma", "bound"} of a relative error and its standard error. bound: the error is below
// 2 sigma, and value is the upper limit |error| + 2 sigma.
nlohmann::json error_of(double error, double sigma);

// The entry of a row that the others are measured against.
nlohmann::json reference_entry();

// Name of a row's case: device, group, area fraction and restitution. Rows of one case are comparable.
std::string case_of(const nlohmann::json& row);

// Sets row["errors"][error]["front"] of each row that has this error: true if no other row of its case beats
// it in both cost and error. Upper bounds count as values.
void mark_front(nlohmann::json& rows, const std::string& error);

}  // namespace pf
