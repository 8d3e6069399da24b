// Texts in tests.
#pragma once

#include <string>

namespace pf {

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace pf
