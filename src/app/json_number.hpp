// Values in JSON, which has neither NaN nor infinity.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace pf {

// null unless the value is finite.
inline nlohmann::json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

inline bool has_text(const nlohmann::json& object, const char* key) {
  return object.contains(key) && object[key].is_string();
}

}  // namespace pf
