// Method `exact` on the device: the ball's events, one after the other, and the segments that they begin.
#pragma once

#include "cuda/exact/ball_path.cuh"

namespace pf::cuda {

__device__ inline bool is_same(const BallTrajectory& a, const BallTrajectory& b) {
  return a.anchor_units.x == b.anchor_units.x && a.anchor_units.y == b.anchor_units.y &&
         a.velocity_mps.x == b.velocity_mps.x && a.velocity_mps.y == b.velocity_mps.y &&
         a.spin_radps == b.spin_radps && a.tick == b.tick;
}

__device__ inline bool is_same(const BallSegment& a, const BallSegment& b) {
  return a.begin == b.begin && a.partner == b.partner && a.next_generation == b.next_generation &&
         is_same(a.trajectory, b.trajectory);
}

// The ball where its path has been traced to.
struct TracedBall {
  ExactBall ball;
  std::uint32_t next_generation;  // see generation_at
  std::uint32_t num_segments;
};

__device__ __forceinline__ std::uint32_t generation_of_ball(const TracedBall& it, std::uint32_t tick) {
  return generation_at(tick, it.ball.trajectory.tick, it.next_generation);
}

// False only if keep_ball_edge_event finds no event, whose two divisions are spared then: the distance to
// either wall is more than what the ball covers until two ticks after the window's end.
template <Boundary kBoundary>
__device__ __forceinline__ bool may_reach_wall(const ExactConstants& c, const BallTrajectory& ball) {
  if (kBoundary != Boundary::walls || c.plan.ball != BallRole::participant) return false;
  const World& world = c.run.physics.world;
  const double radius = c.run.physics.ball.radius_m / world.unit_m;
  const double ticks = static_cast<double>(c.plan.length) - static_cast<double>(ball.tick) + 2.0;
  const Vec2d v = ball.velocity_mps * c.plan.units_per_tick;
  const auto is_far = [&](double coordinate, double velocity, std::int32_t half) {
    const double limit = half - radius;
    return velocity > 0.0 ? limit - coordinate > velocity * ticks : limit + coordinate > -velocity * ticks;
  };
  return !is_far(ball.anchor_units.x, v.x, world.half.x) || !is_far(ball.anchor_units.y, v.y, world.half.y);
}

// The ball's next event: a hit, or a wall before it. No event has kNoTick.
template <Boundary kBoundary>
__device__ __forceinline__ Event next_ball_event(const ExactConstants& c, const TracedBall& it,
                                                 const Event& hit) {
  Event edge;
  if (may_reach_wall<kBoundary>(c, it.ball.trajectory))
    keep_ball_edge_event<kBoundary>(c, it.ball.trajectory, edge);
  edge.generation = generation_of_ball(it, edge.tick);
  return comes_before(hit, edge) ? hit : edge;
}

// The ball is hit by a parcel that is on a trajectory until then.
template <Boundary kBoundary>
__device__ __forceinline__ void apply_hit(const ExactConstants& c, const Event& event, Trajectory parcel,
                                          TracedBall& it) {
  ClusterTally ignored;
  anchor_at<kBoundary>(c, parcel, event.tick);
  const BallReaction reaction =
      collide_with_ball<kBoundary>(c, it.ball.trajectory, event.tick, parcel, ignored);
  apply_to_ball(c, event.tick, kBallPartner, reaction, it.ball);
}

// Returns whether there is room for one more segment; if not, the window is retried.
__device__ __forceinline__ bool has_room(ExactState& state, const TracedBall& it) {
  if (it.num_segments < kMaxBallSegments) return true;
  state.solve_failed = 1;
  return false;
}

// Writes the segment that the ball is on, the latest one. cause: but for the ball's velocity.
__device__ __forceinline__ void write_segment(const StepMemory& memory, std::uint32_t buffer,
                                              const TracedBall& it, const Event& event, SegmentCause cause) {
  const std::uint32_t k = it.num_segments - 1;
  cause.end_velocity_mps = it.ball.end_velocity_mps;
  memory.ball_paths[buffer][k] = {it.ball.trajectory, event.tick, event.partner, it.next_generation};
  memory.segment_causes[buffer][k] = cause;
}

// A segment's contribution to the summary of its path.
struct SegmentSummary {
  bool begins_at_wall;
  bool is_bent;  // leaves less than half of kPathMargin to where the first segment leads
  unsigned long long wall_event_hash;
};

// Not for the first segment. Notes speeds above the bound.
__device__ __forceinline__ SegmentSummary summary_of(const ExactConstants& c, ExactState& state,
                                                     const BallSegment& segment) {
  const double surface_mps = surface_speed_mps(c.run.physics, segment.trajectory);
  if (surface_mps > c.plan.max_speed_mps)
    atomicMax(&state.too_fast_bits, __float_as_uint(static_cast<float>(surface_mps) * (1.0F + 1e-6F)));
  const Vec2d bend = segment.trajectory.velocity_mps - state.ball.trajectory.velocity_mps;
  const double bound = bend_units(c.plan, bend, state.window_begin);
  if (is_parcel(segment.partner)) return {false, !(bound < 0.5 * kPathMargin), 0};
  const std::uint64_t at =
      state.progress.now + (static_cast<std::uint64_t>(segment.begin) << state.progress.tick_exponent);
  return {true, true, event_hash(at, segment.partner, kBallPartner)};
}

// Assumes that nothing hits the ball in the window. Called by one thread.
__device__ inline void start_ball_path(const RunConstants& run, const StepMemory& memory, ExactState& state) {
  state.num_ball_hits = 0;
  state.num_ball_segments = state.num_solved_segments = 0;
  state.ball_joins = 0;
  state.ball_owner = kInvalidIndex;
  state.path_is_checked = 1;
  if (state.plan.ball == BallRole::absent) return;
  ExactConstants c{run, state.plan};
  c.plan.length = state.window_end;
  TracedBall it{state.ball, 0, 1};
  write_segment(memory, state.ball_path, it, {0, 0, 0, 0}, {});
  state.num_wall_events = 0;
  state.wall_event_hash = 0;
  while (run.physics.world.boundary == Boundary::walls) {
    const Event edge = next_ball_event<Boundary::walls>(c, it, {});
    if (edge.tick == kNoTick || !has_room(state, it)) break;
    apply_to_ball(c, edge.tick, edge.partner, {}, it.ball);
    it.next_generation = edge.generation + 1;
    ++it.num_segments;
    write_segment(memory, state.ball_path, it, edge, {});
    ++state.num_wall_events;
    state.wall_event_hash +=
        summary_of(c, state, memory.ball_paths[state.ball_path][it.num_segments - 1]).wall_event_hash;
  }
  state.path_is_straight = it.num_segments == 1 ? 1U : 0U;
  state.path_has_changed = 1;
  state.num_same_segments = 1;
  state.num_ball_segments = it.num_segments;
  state.ball_at_end = it.ball;
}

}  // namespace pf::cuda
