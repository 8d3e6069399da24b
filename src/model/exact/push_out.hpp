// Pushes overlaps apart before method `exact` begins, which another method or a larger radius has left, in
// sweeps of PushOutContact (model/contact.hpp) over all parcels.
#pragma once

#include "model/exact/trajectory.hpp"
#include "model/parcel.hpp"

namespace pf {

constexpr int kMaxPushOutSweeps = 50;  // a crowd may keep overlaps

// Overlap after which no sweep follows, contact distances.
inline float push_out_tolerance(const StepConstants& c) {
  return static_cast<float>(kRoundingMargin / c.contact_distance);
}

}  // namespace pf
