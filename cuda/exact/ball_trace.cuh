// Method `exact` on the device: traces the path of a ball through its hits and walls in a window.
#pragma once

#include "cuda/exact/ball_path.cuh"
#include "cuda/exact/event_order.cuh"

namespace pf::cuda {

__device__ inline bool is_same(const BallTrajectory& a, const BallTrajectory& b) {
  return a.anchor_units.x == b.anchor_units.x && a.anchor_units.y == b.anchor_units.y &&
         a.velocity_mps.x == b.velocity_mps.x && a.velocity_mps.y == b.velocity_mps.y &&
         a.spin_radps == b.spin_radps && a.tick == b.tick;
}

// The path that is being traced, in a block's shared memory.
struct PathTrace {
  ExactBall ball;
  std::uint32_t next_generation;  // see generation_at
  std::uint32_t num_segments;
  std::uint32_t is_done, has_changed, bounces;
  double bend_mps;  // largest change of velocity along an axis
};

__device__ inline void start_trace(const StepMemory& memory, ExactState& state, PathTrace& trace) {
  trace = {state.ball, 0, 1, 0, state.num_ball_segments == 0 ? 1U : 0U, 0, 0.0};
  memory.ball_paths[state.ball_path ^ 1U][0] = {state.ball.trajectory, 0, 0, 0};
  state.num_wall_events = 0;
  state.wall_event_hash = 0;
}

// Adds the segment that an event of the ball led to.
__device__ inline void add_segment(const ExactConstants& c, const StepMemory& memory, ExactState& state,
                                   const BallSegment& segment, PathTrace& trace) {
  if (trace.num_segments == kMaxBallSegments) {
    state.solve_failed = 1;
    trace.is_done = 1;
    return;
  }
  const double surface_mps = surface_speed_mps(c.run.physics, segment.trajectory);
  if (surface_mps > c.plan.max_speed_mps)
    atomicMax(&state.too_fast_bits, __float_as_uint(static_cast<float>(surface_mps) * (1.0F + 1e-6F)));
  const std::uint32_t k = trace.num_segments++;
  const BallSegment& old = memory.ball_paths[state.ball_path][k];
  if (k >= state.num_ball_segments || old.begin != segment.begin || old.partner != segment.partner ||
      old.next_generation != segment.next_generation || !is_same(old.trajectory, segment.trajectory))
    trace.has_changed = 1;
  memory.ball_paths[state.ball_path ^ 1U][k] = segment;
  const Vec2d bend = segment.trajectory.velocity_mps - state.ball.trajectory.velocity_mps;
  trace.bend_mps = fmax(trace.bend_mps, fmax(fabs(bend.x), fabs(bend.y)));
}

__device__ __forceinline__ std::uint32_t generation_of_ball(const PathTrace& trace, std::uint32_t tick) {
  return generation_at(tick, trace.ball.trajectory.tick, trace.next_generation);
}

// Takes the ball to its next event: a hit by a parcel that is on a trajectory, or a wall before it.
template <Boundary kBoundary>
__device__ bool trace_event(const ExactConstants& c, const StepMemory& memory, ExactState& state,
                            const Event& hit, Trajectory parcel, PathTrace& trace) {
  Event edge;
  if (c.plan.ball == BallRole::participant) keep_ball_edge_event<kBoundary>(c, trace.ball.trajectory, edge);
  edge.generation = generation_of_ball(trace, edge.tick);
  if (hit.tick == kNoTick && edge.tick == kNoTick) {
    trace.is_done = 1;
    return false;
  }
  const bool hits = comes_before(hit, edge);
  trace.next_generation = (hits ? hit.generation : edge.generation) + 1;
  if (hits) {
    ClusterTally ignored;
    anchor_at<kBoundary>(c, parcel, hit.tick);
    const BallReaction reaction =
        collide_with_ball<kBoundary>(c, trace.ball.trajectory, hit.tick, parcel, ignored);
    apply_to_ball(c, hit.tick, kBallPartner, reaction, trace.ball);
    add_segment(c, memory, state, {trace.ball.trajectory, hit.tick, hit.partner_id, trace.next_generation},
                trace);
  } else {
    apply_to_ball(c, edge.tick, edge.partner, {}, trace.ball);
    ++state.num_wall_events;
    const std::uint64_t at =
        state.progress.now + (static_cast<std::uint64_t>(edge.tick) << state.progress.tick_exponent);
    state.wall_event_hash += event_hash(at, edge.partner, kBallPartner);
    trace.bounces = 1;
    add_segment(c, memory, state, {trace.ball.trajectory, edge.tick, edge.partner, trace.next_generation},
                trace);
  }
  return hits;
}

__device__ inline void finish_trace(const ExactConstants& c, ExactState& state, const PathTrace& trace) {
  const double most = trace.bend_mps * c.plan.units_per_tick * (c.plan.length - state.window_begin);
  state.path_is_straight = trace.bounces == 0 && most < 0.5 * kPathMargin ? 1U : 0U;
  state.path_has_changed = trace.has_changed != 0 || trace.num_segments != state.num_ball_segments ? 1U : 0U;
  state.num_ball_segments = trace.num_segments;
  state.ball_path ^= 1U;
  state.ball_at_end = trace.ball;
}

// Assumes that nothing hits the ball in the window. Called by one thread.
__device__ inline void start_ball_path(const RunConstants& run, const StepMemory& memory, ExactState& state) {
  state.num_ball_hits = 0;
  state.num_ball_segments = 0;
  state.path_is_checked = 1;
  if (state.plan.ball == BallRole::absent) return;
  ExactConstants c{run, state.plan};
  c.plan.length = state.window_end;
  PathTrace trace;
  start_trace(memory, state, trace);
  while (trace.is_done == 0) {
    if (run.physics.world.boundary == Boundary::walls) {
      trace_event<Boundary::walls>(c, memory, state, {}, {}, trace);
    } else {
      trace_event<Boundary::open>(c, memory, state, {}, {}, trace);
    }
  }
  finish_trace(c, state, trace);
}

// Hits that a path is traced through, in a block's shared memory.
struct PathHits {
  static constexpr std::uint32_t kMax = kMaxBallSegments / 2;
  std::uint32_t hit[kMax];  // indices of hits; kInvalidIndex after it was traced
  std::uint32_t num;
  OrderedEvent first_of_warps[kExactBlock / 32];
  PathTrace trace;
};

// Traces the path through the hits for which belongs(hit) is true. The next one is that which the ball would
// meet first on its present trajectory, as in the serial program. Called by all threads of one block.
template <Boundary kBoundary, class Belongs>
__device__ void trace_ball_path(const StepContext& step, PathHits& space, Belongs belongs) {
  const BallHit* hits = step.memory.ball_hits;
  ExactState& state = step.state;
  const std::uint32_t num_logged = min(state.num_ball_hits, step.memory.ball_hit_capacity);
  if (threadIdx.x == 0) {
    space.num = 0;
    start_trace(step.memory, state, space.trace);
  }
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < num_logged; k += kExactBlock) {
    if (!belongs(hits[k])) continue;
    const std::uint32_t place = atomicAdd(&space.num, 1U);
    if (place < PathHits::kMax) space.hit[place] = k;
  }
  __syncthreads();
  const std::uint32_t num = min(space.num, PathHits::kMax);
  if (space.num > num) state.solve_failed = 1;
  while (space.trace.is_done == 0) {
    OrderedEvent next;
    const BallTrajectory ball = space.trace.ball.trajectory;
    for (std::uint32_t p = threadIdx.x; p < num; p += kExactBlock) {
      if (space.hit[p] == kInvalidIndex) continue;
      const BallHit& hit = hits[space.hit[p]];
      const std::uint32_t tick = ball_collision_tick<kBoundary>(step.c, ball, hit.before);
      if (tick == kNoTick) continue;
      const std::uint32_t generation =
          max(generation_of_ball(space.trace, tick),
              generation_at(tick, anchor_time(step.c.plan, hit.before), hit.next_generation));
      const OrderedEvent event{tick, generation, hit.id, kBallPartner, p};
      if (comes_before(event, next)) next = event;
    }
    next = first_of_block(next, space.first_of_warps);
    if (threadIdx.x == 0) {
      const bool exists = next.tick != kNoTick;
      const BallHit hit = exists ? hits[space.hit[next.place]] : BallHit{};
      const Event event = exists ? Event{next.tick, hit.id, hit.id, next.generation} : Event{};
      if (trace_event<kBoundary>(step.c, step.memory, state, event, hit.before, space.trace)) {
        if (hit.tick != next.tick) space.trace.has_changed = 1;
        space.hit[next.place] = kInvalidIndex;
      }
    }
    __syncthreads();
  }
  for (std::uint32_t p = threadIdx.x; p < num; p += kExactBlock) {
    if (space.hit[p] != kInvalidIndex) space.trace.has_changed = 1;  // the ball does not meet that parcel
  }
  __syncthreads();
  if (threadIdx.x == 0) finish_trace(step.c, state, space.trace);
}

// Assumes the hits that parcels expect at the window's start. Called by all threads of one block.
template <Boundary kBoundary>
__device__ void expect_hits(const StepContext& step, PathHits& space) {
  if (!step.has_participant() || step.state.num_ball_hits == 0) return;
  trace_ball_path<kBoundary>(step, space, [](const BallHit&) { return true; });
  __syncthreads();
  if (threadIdx.x != 0) return;
  step.state.num_ball_hits = 0;
  step.state.path_is_checked = 0;
}

}  // namespace pf::cuda
