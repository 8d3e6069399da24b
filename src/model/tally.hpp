// The interface through which formulas report collisions and moves. Every backend has its own tallies. They
// hold sums of integers and extremes, so that the order of reports does not matter.
#pragma once

#include <concepts>
#include <cstdint>

#include "model/ball.hpp"

namespace pf {

// Tally of collisions.
template <class T>
concept EventTally = requires(T tally, std::int32_t counts, float diameters, const BallSums& hit) {
  tally.begin_contact();     // a pair starts to touch
  tally.impulse(counts);     // of a pair, as impulse_counts() gives it
  tally.overlap(diameters);  // of a pair at its contact
  tally.ball_hit(hit);       // impulse and torque on the ball
};

// Tally of a whole step of the time-stepped methods.
template <class T>
concept StepTally = EventTally<T> && requires(T tally, std::int32_t displacement, std::uint32_t id) {
  tally.moved(displacement);  // of a parcel, position units along an axis
  tally.retired();            // a parcel left the world
  tally.invalid(id);          // a parcel's state is not a number or out of range
};

}  // namespace pf
