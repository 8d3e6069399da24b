// What the Pareto picture of the work-precision study shows, in words.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// Sentences, a JSON list, from a result that conclude_work_precision has given its errors and orders: by
// device and kind of error, below which error `exact` is the cheapest, where `impulse` is enough, where
// `spring` makes sense (gas at restitution 1, ball at the lowest of the table); and orders of convergence. A
// method meets an error with a step if it does with all shorter ones, too; upper bounds count as they are.
nlohmann::json work_precision_summary(const nlohmann::json& result);

}  // namespace pf
