// A summary in sentences of the work-precision study's chart of error against cost.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// Returns sentences, a JSON list. result: with errors and orders of conclude_work_precision. For each device
// and kind of error they give the cheapest method by size of the error (gas at restitution 1, ball at the
// lowest restitution of the table), then the orders of convergence. A method reaches an error with a step if
// all shorter steps reach it too. Upper bounds count as values.
nlohmann::json work_precision_summary(const nlohmann::json& result);

}  // namespace pf
