// Method `exact` on the device: parcels' positions at the step's ends.
#pragma once

#include "backend/draw_buffers.hpp"
#include "cuda/exact/step_context.cuh"

namespace pf::cuda {

__device__ inline bool reaches_end(const StepContext& step) {
  return step.since_reset(step.state.plan.length) >= step.launch.until;
}

// Stores the position of parcel i at the step's end, for the renderer too if the request's last step ends.
__device__ inline void write_position(const StepContext& step, std::uint32_t i, Vec2i end, Vec2f velocity) {
  const DrawBuffers& draw = step.launch.draw;
  step.memory.positions[step.state.current_buffer ^ 1U][i] = end;
  if (draw.position_m != nullptr && reaches_end(step))
    draw_parcel(draw, step.launch.run.physics.world, i, end, velocity);
}

// The same for a parcel that stays on the trajectory.
template <Boundary kBoundary>
__device__ void write_end_position(const StepContext& step, std::uint32_t i, const Trajectory& trajectory) {
  const auto end = static_cast<std::int32_t>(step.state.plan.length);
  write_position(step, i, position_at<kBoundary>(step.c, trajectory, end), trajectory.velocity);
}

}  // namespace pf::cuda
