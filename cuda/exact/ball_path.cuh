// Method `exact` on the device: the path of a participating ball through a window.
//
// A hit changes the ball's velocity by some millionth of itself. So clusters are solved side by side against an assumed
// path, at first that through the hits that parcels expect at the window's start. The hits that the clusters have, in
// their order, give the path anew. Clusters that hit the ball are solved again against that, until the path no longer
// changes in any bit. Then every hit happened on the ball's true trajectory: the solution is that of the serial program.
#pragma once

#include "cuda/exact/clusters.cuh"

namespace pf::cuda {

__device__ inline const BallSegment* ball_path(const StepContext& step) {
  return step.memory.ball_paths[step.state.ball_path];
}

// A hit on the assumed path: its tick, or kNoTick, and the segment on which the ball is then.
struct PathHit {
  std::uint32_t tick = kNoTick, segment = 0;
};

// The next hit of parcel `id`. Of events that are expected at one tick that with the lower id comes first. change: how
// the parcel came to its trajectory, a value of Member::has_changed. After a hit it meets the ball as that left it; if
// the path does not have the hit yet, the next one cannot be told, and does not matter: the cluster will be solved again.
template <Boundary kBoundary>
__device__ PathHit hit_on_path(const StepContext& step, const Trajectory& parcel, std::uint32_t id,
                               std::uint32_t change) {
  const ExactConstants& c = step.c;
  const BallSegment* path = ball_path(step);
  const std::uint32_t num = step.state.num_ball_segments;
  const std::int32_t anchor = anchor_time(c.plan, parcel);
  const bool just_hit = change == kHitBall && step.has_participant();
  std::uint32_t own = 0;
  for (std::uint32_t s = 1; just_hit && s < num; ++s) {
    if (path[s].partner == id && static_cast<std::int64_t>(path[s].begin) == anchor) own = s;
  }
  if (just_hit && own == 0) return {};
  std::uint32_t first = own;
  if (step.state.path_is_straight != 0 && num > 1) {
    // Whoever hits the path is within the margin of its first segment then: it comes there, or was there before.
    const RelativeMotion motion = motion_from_ball<kBoundary>(c, path[0].trajectory, parcel);
    const double near = c.run.ball_contact + kPathMargin;
    if (dot(motion.offset, motion.offset) > near * near) {
      const std::uint32_t tick = contact_tick(c.plan, motion, near);
      if (tick == kNoTick) return {};
      while (first + 1 < num && path[first + 1].begin < tick) ++first;
    }
  }
  for (std::uint32_t s = first; s < num; ++s) {
    const bool is_last = s + 1 == num;
    const std::uint32_t end = is_last ? kNoTick : path[s + 1].begin;
    const std::uint32_t partner = is_last ? kNoPartner : path[s + 1].partner;
    const auto end_time = static_cast<std::int64_t>(end);
    if (end_time < anchor || (end_time == anchor && change == kChanged && partner < id)) continue;
    const std::uint32_t tick = ball_collision_tick<kBoundary>(c, path[s].trajectory, parcel);
    if (tick != kNoTick && (tick < end || (tick == end && id <= partner))) return {tick, s};
  }
  return {};
}

__device__ inline void add_ball_hit(const StepContext& step, const BallHit& hit) {
  const std::uint32_t k = atomicAdd(&step.state.num_ball_hits, 1U);
  if (k < step.memory.ball_hit_capacity) {
    step.memory.ball_hits[k] = hit;
  } else {
    step.state.solve_failed = 1;
  }
}

__device__ inline bool is_same(const BallTrajectory& a, const BallTrajectory& b) {
  return a.anchor_units.x == b.anchor_units.x && a.anchor_units.y == b.anchor_units.y &&
         a.velocity_mps.x == b.velocity_mps.x && a.velocity_mps.y == b.velocity_mps.y &&
         a.spin_radps == b.spin_radps && a.tick == b.tick;
}

// Sort key of an event, whose parts are compared in turn; the first one is its tick. All bits set: no event.
__device__ __forceinline__ bool is_before(const uint4& p, const uint4& q) {
  if (p.x != q.x) return p.x < q.x;
  if (p.y != q.y) return p.y < q.y;
  return p.z != q.z ? p.z < q.z : p.w < q.w;
}

// Lowest of the threads' keys, in all of them. space: of each warp, in the block's shared memory.
__device__ __forceinline__ uint4 min_over_block(uint4 best, uint4 (&space)[kExactBlock / 32]) {
  for (unsigned offset = 16; offset > 0; offset /= 2) {
    const uint4 other{
        __shfl_xor_sync(kWholeWarp, best.x, offset), __shfl_xor_sync(kWholeWarp, best.y, offset),
        __shfl_xor_sync(kWholeWarp, best.z, offset), __shfl_xor_sync(kWholeWarp, best.w, offset)};
    if (is_before(other, best)) best = other;
  }
  if (threadIdx.x % 32 == 0) space[threadIdx.x / 32] = best;
  __syncthreads();
  for (const uint4& other : space) {
    if (is_before(other, best)) best = other;
  }
  __syncthreads();
  return best;
}

// The path that is being traced, in a block's shared memory.
struct PathTrace {
  ExactBall ball;
  std::uint32_t num_segments;
  std::uint32_t is_done, has_changed, bounces;
  double bend_mps;  // largest change of velocity along an axis
};

__device__ inline void start_trace(const StepMemory& memory, ExactState& state, PathTrace& trace) {
  trace = {state.ball, 1, 0, state.num_ball_segments == 0 ? 1U : 0U, 0, 0.0};
  memory.ball_paths[state.ball_path ^ 1U][0] = {state.ball.trajectory, 0, 0};
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
      !is_same(old.trajectory, segment.trajectory))
    trace.has_changed = 1;
  memory.ball_paths[state.ball_path ^ 1U][k] = segment;
  const Vec2d bend = segment.trajectory.velocity_mps - state.ball.trajectory.velocity_mps;
  trace.bend_mps = fmax(trace.bend_mps, fmax(fabs(bend.x), fabs(bend.y)));
}

// Takes the ball to its next event: a hit at `tick` by a parcel that is on a trajectory, or a wall before it.
template <Boundary kBoundary>
__device__ bool trace_event(const ExactConstants& c, const StepMemory& memory, ExactState& state, std::uint32_t tick,
                            std::uint32_t id, Trajectory parcel, PathTrace& trace) {
  Event edge;
  if (c.plan.ball == BallRole::participant)
    keep_ball_edge_event<kBoundary>(c, trace.ball.trajectory, edge);
  if (tick == kNoTick && edge.tick == kNoTick) {
    trace.is_done = 1;
    return false;
  }
  const bool hits = tick <= edge.tick;
  if (hits) {
    ClusterTally ignored;
    anchor_at<kBoundary>(c, parcel, tick);
    const BallReaction reaction = collide_with_ball<kBoundary>(c, trace.ball.trajectory, tick, parcel, ignored);
    apply_to_ball(c, tick, kBallPartner, reaction, trace.ball);
    add_segment(c, memory, state, {trace.ball.trajectory, tick, id}, trace);
  } else {
    apply_to_ball(c, edge.tick, edge.partner, {}, trace.ball);
    ++state.num_wall_events;
    const std::uint64_t at =
        state.progress.now + (static_cast<std::uint64_t>(edge.tick) << state.progress.tick_exponent);
    state.wall_event_hash += event_hash(at, edge.partner, kBallPartner);
    trace.bounces = 1;
    add_segment(c, memory, state, {trace.ball.trajectory, edge.tick, edge.partner}, trace);
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
      trace_event<Boundary::walls>(c, memory, state, kNoTick, 0, {}, trace);
    } else {
      trace_event<Boundary::open>(c, memory, state, kNoTick, 0, {}, trace);
    }
  }
  finish_trace(c, state, trace);
}

// Hits that a path is traced through, in a block's shared memory.
struct PathHits {
  static constexpr std::uint32_t kMax = kMaxBallSegments / 2;
  std::uint32_t hit[kMax];  // indices of hits; kInvalidIndex after it was traced
  std::uint32_t num;
  uint4 first_of_warps[kExactBlock / 32];
  PathTrace trace;
};

// Traces the path through the hits for which belongs(hit) is true. The next one is that which the ball would meet first
// on its present trajectory, as in the serial program. Called by all threads of one block.
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
    // Tick, id, age of the parcel's trajectory, place.
    uint4 next{kNoTick, kInvalidIndex, kInvalidIndex, kInvalidIndex};
    const BallTrajectory ball = space.trace.ball.trajectory;
    for (std::uint32_t p = threadIdx.x; p < num; p += kExactBlock) {
      if (space.hit[p] == kInvalidIndex) continue;
      const BallHit& hit = hits[space.hit[p]];
      const std::uint32_t tick = ball_collision_tick<kBoundary>(step.c, ball, hit.before);
      const auto age = static_cast<std::uint32_t>(anchor_time(step.c.plan, hit.before)) + 0x80000000U;
      const uint4 key{tick, hit.id, age, p};
      if (tick != kNoTick && is_before(key, next)) next = key;
    }
    next = min_over_block(next, space.first_of_warps);
    if (threadIdx.x == 0) {
      const bool exists = next.x != kNoTick;
      const BallHit hit = exists ? hits[space.hit[next.w]] : BallHit{};
      if (trace_event<kBoundary>(step.c, step.memory, state, next.x, hit.id, hit.before, space.trace)) {
        if (hit.tick != next.x) space.trace.has_changed = 1;
        space.hit[next.w] = kInvalidIndex;
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
