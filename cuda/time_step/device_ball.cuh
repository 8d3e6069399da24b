// The ball between two steps, on the device.
#pragma once

#include "cuda/tally.cuh"
#include "cuda/time_step/kernel.cuh"

namespace pf {

// Plans the ball's flight and motion in the next step.
__device__ inline void plan_ball(const StepConstants& c, const BallState& ball, StepState& state) {
  const BallFlight flight = fly(c.physics.ball, ball, c.dt_s);
  state.flight = flight;
  state.motion = ball_motion(c.physics.world, c.physics.ball, ball, flight, c.ball_contact_m);
}

// Moves the ball past a step, and plans the next one. slots: kNumSlots tallies of that step, one for each
// thread of a warp, all of which call it.
__device__ inline void move_ball(const StepConstants& c, const TallySlot* slots, StepState& state) {
  BallState ball = state.ball;  // on its way with the slots
  const BallFlight flight = state.flight;
  const TallySlot& slot = slots[threadIdx.x % 32];
  const BallSums hits{static_cast<std::int64_t>(sum_over_warp(slot.ball_x)),
                      static_cast<std::int64_t>(sum_over_warp(slot.ball_y)),
                      static_cast<std::int64_t>(sum_over_warp(slot.ball_torque))};
  if (threadIdx.x % 32 != 0) return;
  advance_ball(c.physics.world, c.physics.ball, flight, hits, c.impulse_unit_kg_mps, ball);
  state.ball = ball;
  plan_ball(c, ball, state);
}

}  // namespace pf
