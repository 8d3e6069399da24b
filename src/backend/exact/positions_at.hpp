// Positions of many parcels on their trajectories at one tick: position_at of model/exact/trajectory.hpp,
// vectorised, with the same bits. A parcel without a finite speed stays at its anchor.
#pragma once

#include <cstddef>
#include <cstdint>

#include "model/exact/trajectory.hpp"

namespace pf {

// Trajectories as arrays; the fields are those of Trajectory.
struct TrajectoryArrays {
  const Vec2i* anchor;
  const Vec2f* velocity;
  const std::uint32_t* tick;
};

// Sets position[begin .. end - 1] to the positions at a tick of the step.
void positions_at(const ExactConstants& c, const TrajectoryArrays& trajectories, std::int32_t tick,
                  std::size_t begin, std::size_t end, Vec2i* position);

}  // namespace pf
