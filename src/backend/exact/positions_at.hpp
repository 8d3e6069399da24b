// Where many parcels are on their lines at one tick: position_at of model/exact.hpp, with what the processor
// has, to the last bit. One without a finite speed stays at its anchor.
#pragma once

#include <cstddef>
#include <cstdint>

#include "model/exact/trajectory.hpp"

namespace pf {

// Sets position[begin .. end - 1] to where the lines are at a tick of the step. anchor, velocity and
// anchor_tick: as in Line.
void positions_at(const ExactConstants& c, const Vec2i* anchor, const Vec2f* velocity,
                  const std::uint32_t* anchor_tick, std::int32_t tick, std::size_t begin, std::size_t end,
                  Vec2i* position);

}  // namespace pf
