// A parcel's entries in the renderer's buffers.
#pragma once

#include "backend/draw_buffers.hpp"

namespace pf {

__device__ inline void draw_parcel(const DrawBuffers& draw, const World& world, std::uint32_t i,
                                   Vec2i position, Vec2f velocity) {
  const DrawnParcel drawn = drawn_parcel(world, position, velocity);
  draw.position_m[i] = drawn.position_m;
  draw.speed_mps[i] = drawn.speed_mps;
}

}  // namespace pf
