// One event of method `exact`, for tests and the lab.
#pragma once

#include <cstdint>

namespace pf {

struct EventRecord {
  std::uint64_t tick = 0;    // since the reset
  std::uint32_t first = 0;   // parcel id
  std::uint32_t second = 0;  // parcel id, or one of the partner codes of model/exact/events.hpp
};

}  // namespace pf
