// The ball between two steps, on the device.
#pragma once

#include "cuda/tally.cuh"
#include "cuda/time_step/kernel.cuh"

namespace pf {

// Plans the ball's flight and motion in the next step. A whole warp calls it with the same arguments: lanes
// share the velocities along the flight, which took one thread most of the time that a step waits for the
// ball.
__device__ inline void plan_ball(const StepConstants& c, const BallState& ball, StepState& state) {
  const BallFlight flight = fly(c.physics.ball, ball, c.dt_s, [](auto velocity_of, Vec2d(&velocity)[6]) {
    const Vec2d of_lane = velocity_of(min(threadIdx.x % 32, 5U));
#pragma unroll
    for (unsigned k = 0; k < 6; ++k)
      velocity[k] = {__shfl_sync(0xFFFFFFFFU, of_lane.x, k), __shfl_sync(0xFFFFFFFFU, of_lane.y, k)};
  });
  const BallMotion motion = ball_motion(c.physics.world, c.physics.ball, ball, flight, c.ball_contact_m);
  if (threadIdx.x % 32 != 0) return;
  state.flight = flight;
  state.motion = motion;
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
  advance_ball(c.physics.world, c.physics.ball, flight, hits, c.impulse_unit_kg_mps, ball);
  if (threadIdx.x % 32 == 0) state.ball = ball;
  plan_ball(c, ball, state);
}

}  // namespace pf
