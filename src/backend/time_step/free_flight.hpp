// The step of parcels that nothing happens to, four at a time.
//
// Most parcels of most steps touch no other, and are far from ball and edge. finish_step
// (model/time_step.hpp) then only adds velocity times step and rounds. This loop does that with vector
// instructions, to the same bits, and lists the parcels that ball or edge may act on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/ball.hpp"
#include "model/parcel.hpp"

namespace pf {

// Arrays by parcel.
struct FreeFlightInput {
  const StepConstants& constants;
  const BallMotion& ball;
  std::uint32_t step_key;
  const Vec2f* velocity;
  const std::uint32_t* id;
  Vec2i* position;       // before the step, and then after it
  std::uint32_t* rough;  // after the step; see rough_positions.hpp
  std::int32_t rough_shift;
};

// Result of a loop over a range of parcels.
struct FreeFlights {
  std::vector<std::uint32_t> others;  // parcels whose step is still to be done, in order
  std::int32_t max_displacement = 0;  // at least that of all but the others: position units, along an axis
};

// Moves the parcels begin .. end - 1, except result.others, as if none touched another.
using FreeFlight = void (*)(const FreeFlightInput& in, std::size_t begin, std::size_t end,
                            FreeFlights& result);

// Null: this processor lacks the instructions.
FreeFlight choose_free_flight(bool has_ball, Boundary boundary);

}  // namespace pf
