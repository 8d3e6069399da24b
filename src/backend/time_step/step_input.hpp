// Input of one step of a time-stepped method.
#pragma once

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

}  // namespace pf
