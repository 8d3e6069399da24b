// A parcel's entries in the renderer's buffers.
#pragma once

#include "backend/draw_buffers.hpp"
#include "model/world.hpp"

namespace pf {

__device__ inline void draw_parcel(const DrawBuffers& draw, const World& world, std::uint32_t i,
                                   Vec2i position, Vec2f velocity) {
  const bool gone = is_retired(position);
  draw.position_m[i] = gone ? Vec2f{kOutOfSight_m, kOutOfSight_m} : to_float(to_metres(world, position));
  draw.speed_mps[i] = sqrtf(velocity.x * velocity.x + velocity.y * velocity.y);
}

}  // namespace pf
