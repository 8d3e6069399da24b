// Method `exact`: an event that a parcel keeps, as one word that compares as the events do. Host and device
// code.
#pragma once

#include <cstdint>

#include "model/exact/events.hpp"

namespace pf {

// The tick in the upper half, the partner's index or code in the lower one.
using EventKey = unsigned long long;  // the type of CUDA's atomics
constexpr EventKey kNoEventKey = ~0ULL;

PF_HD inline EventKey event_key(std::uint32_t tick, std::uint32_t partner) {
  return static_cast<EventKey>(tick) << 32U | partner;
}
PF_HD inline std::uint32_t tick_of(EventKey event) { return static_cast<std::uint32_t>(event >> 32U); }
PF_HD inline std::uint32_t partner_of(EventKey event) { return static_cast<std::uint32_t>(event); }

// The earlier tick comes first; of one tick, the lower partner id. id_of: of a partner.
template <class IdOf>
PF_HD inline bool comes_before(EventKey a, EventKey b, const IdOf& id_of) {
  if (tick_of(a) != tick_of(b)) return a < b;
  return a != b && id_of(partner_of(a)) < id_of(partner_of(b));
}

}  // namespace pf
