// Input of one step of a time-stepped method.
#pragma once

#include <cmath>

#include "backend/draw_buffers.hpp"
#include "backend/neighbour_search.hpp"
#include "model/ball.hpp"
#include "model/parcel.hpp"

namespace pf {

struct StepInput {
  const StepConstants& constants;
  const BallMotion& ball;
  std::uint32_t key;  // of the random roundings
  const SearchSpace& space;
  Search search;
  const DrawBuffers* draw;  // null: nothing is drawn
};

inline void draw_parcel(const DrawBuffers& buffers, const World& world, std::size_t i, Vec2i position,
                        Vec2f velocity) {
  const DrawnParcel drawn = drawn_parcel(world, position, velocity);
  buffers.position_m[i] = drawn.position_m;
  buffers.speed_mps[i] = drawn.speed_mps;
}

}  // namespace pf
