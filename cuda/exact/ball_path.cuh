// Method `exact` on the device: the path of a participating ball through a window.
//
// A hit changes the ball's velocity by some millionth of itself. So clusters are solved side by side against
// an assumed path, at first that through the hits that parcels expect at the window's start. The hits that
// the clusters have, in their order, give the path anew. Clusters that hit the ball are solved again against
// that, until the path no longer changes in any bit. Then every hit happened on the ball's true trajectory:
// the solution is that of the serial program.
#pragma once

#include "cuda/exact/clusters.cuh"

namespace pf::cuda {

__device__ inline const BallSegment* ball_path(const StepContext& step) {
  return step.memory.ball_paths[step.state.ball_path];
}

// A hit on the assumed path: its tick, or kNoTick, its generation, and the segment on which the ball is then.
struct PathHit {
  std::uint32_t tick = kNoTick, generation = 0, segment = 0;
};

// A parcel that may hit the ball. just_hit: its trajectory is that after a hit.
struct ParcelNearBall {
  Trajectory trajectory;
  std::uint32_t id;
  std::uint32_t next_generation = 0;  // see generation_at
  bool just_hit = false;
};

// The event that a segment begins with, as the ball sees it. Not for the first one.
__device__ __forceinline__ Event begin_of(const BallSegment& segment) {
  return {segment.begin, segment.partner, segment.partner, segment.next_generation - 1};
}

// The last segment that begins before an event of the ball.
__device__ inline std::uint32_t segment_before(const BallSegment* path, std::uint32_t num,
                                               const Event& event) {
  std::uint32_t found = 0;
  for (std::uint32_t end = num; found + 1 < end;) {
    const std::uint32_t middle = (found + end) / 2;
    if (comes_before(begin_of(path[middle]), event)) {
      found = middle;
    } else {
      end = middle;
    }
  }
  return found;
}

// The hit of a parcel while the ball is on segment s.
template <Boundary kBoundary>
__device__ __forceinline__ PathHit hit_on_segment(const StepContext& step, const BallSegment* path,
                                                  std::uint32_t s, const ParcelNearBall& parcel) {
  const ExactConstants& c = step.c;
  const std::int32_t anchor = anchor_time(c.plan, parcel.trajectory);
  Event end;
  if (s + 1 < step.state.num_ball_segments) end = begin_of(path[s + 1]);
  if (static_cast<std::int64_t>(end.tick) < anchor) return {};
  const std::uint32_t tick = ball_collision_tick<kBoundary>(c, path[s].trajectory, parcel.trajectory);
  const std::uint32_t generation = max(generation_at(tick, anchor, parcel.next_generation),
                                       generation_at(tick, path[s].trajectory.tick, path[s].next_generation));
  if (tick == kNoTick || comes_before(end, {tick, parcel.id, parcel.id, generation})) return {};
  return {tick, generation, s};
}

// Returns whether a segment begins with the hit that led to the parcel's trajectory.
__device__ __forceinline__ bool begins_with_hit_of(const StepContext& step, const BallSegment& segment,
                                                   const ParcelNearBall& parcel) {
  return segment.partner == parcel.id &&
         static_cast<std::int64_t>(segment.begin) == anchor_time(step.c.plan, parcel.trajectory) &&
         segment.next_generation == parcel.next_generation;
}

// Returns whether a parcel meets a path that stays within kPathMargin of its first segment. tick: before that
// it does not.
template <Boundary kBoundary>
__device__ bool meets_straight_path(const StepContext& step, const BallSegment* path,
                                    const ParcelNearBall& parcel, std::uint32_t& tick) {
  const RelativeMotion motion = motion_from_ball<kBoundary>(step.c, path[0].trajectory, parcel.trajectory);
  const double near = step.c.run.ball_contact + kPathMargin;
  tick = dot(motion.offset, motion.offset) > near * near ? contact_tick(step.c.plan, motion, near) : 0U;
  return tick != kNoTick;
}

// The next hit of a parcel. After a hit it meets the ball as that left it; if the path does not have the hit
// yet, the next one cannot be told, and does not matter: the cluster will be solved again.
template <Boundary kBoundary>
__device__ PathHit hit_on_path(const StepContext& step, const ParcelNearBall& parcel) {
  const BallSegment* path = ball_path(step);
  const std::uint32_t num = step.state.num_ball_segments;
  bool is_known = !parcel.just_hit || !step.has_participant();
  for (std::uint32_t s = 1; !is_known && s < num; ++s) is_known = begins_with_hit_of(step, path[s], parcel);
  if (!is_known) return {};
  std::uint32_t first = 0;
  if (step.state.path_is_straight != 0 && num > 1) {
    std::uint32_t tick = 0;
    if (!meets_straight_path<kBoundary>(step, path, parcel, tick)) return {};
    first = segment_before(path, num, {tick, 0, 0});
  }
  for (std::uint32_t s = first; s < num; ++s) {
    const PathHit hit = hit_on_segment<kBoundary>(step, path, s, parcel);
    if (hit.tick != kNoTick) return hit;
  }
  return {};
}

// The same by the lanes of half a warp for a parcel that they have in common. Whole warps call it; a half
// with is_real = false finds nothing.
template <Boundary kBoundary>
__device__ __forceinline__ PathHit hit_on_path_by_half_warp(const StepContext& step,
                                                            const ParcelNearBall& parcel, bool is_real) {
  constexpr unsigned kHalf = 16;
  const BallSegment* path = ball_path(step);
  const std::uint32_t num = is_real ? step.state.num_ball_segments : 0U;
  const std::uint32_t max_num = warp_max(num);
  const auto in_half = [](bool holds) {
    return __ballot_sync(kWholeWarp, holds) >> (threadIdx.x & kHalf) & 0xFFFFU;
  };
  bool is_known = !parcel.just_hit || !step.has_participant();
  PathHit found;
  for (std::uint32_t base = 0; base < max_num; base += kHalf) {
    const std::uint32_t s = base + threadIdx.x % kHalf;
    const bool searches = s < num && found.tick == kNoTick;
    PathHit hit;
    if (searches) hit = hit_on_segment<kBoundary>(step, path, s, parcel);
    if (in_half(searches && s > 0 && begins_with_hit_of(step, path[s], parcel)) != 0) is_known = true;
    const unsigned hits = in_half(hit.tick != kNoTick);
    const unsigned lane = hits != 0 ? __ffs(hits) - 1 : 0U;
    hit = {__shfl_sync(kWholeWarp, hit.tick, lane, kHalf),
           __shfl_sync(kWholeWarp, hit.generation, lane, kHalf), base + lane};
    if (found.tick == kNoTick && hits != 0) found = hit;
    if (__all_sync(kWholeWarp, found.tick != kNoTick || base + kHalf >= num)) break;
  }
  return is_known ? found : PathHit{};
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

// The event that a thread holds, for the order of events. place: where the thread has it.
struct OrderedEvent {
  std::uint32_t tick = kNoTick, generation = kNoTick, low_id = kNoPartner, high_id = kNoPartner;
  std::uint32_t place = kInvalidIndex;
};

__device__ __forceinline__ bool comes_before(const OrderedEvent& p, const OrderedEvent& q) {
  if (p.tick != q.tick) return p.tick < q.tick;
  if (p.generation != q.generation) return p.generation < q.generation;
  if (p.low_id != q.low_id) return p.low_id < q.low_id;
  return p.high_id != q.high_id ? p.high_id < q.high_id : p.place < q.place;
}

// First of the threads' events, in all of them. space: of each warp, in the block's shared memory.
__device__ __forceinline__ OrderedEvent first_of_block(OrderedEvent best,
                                                       OrderedEvent (&space)[kExactBlock / 32]) {
  const auto of_lane = [](std::uint32_t value, unsigned offset) {
    return __shfl_xor_sync(kWholeWarp, value, offset);
  };
  for (unsigned offset = 16; offset > 0; offset /= 2) {
    const OrderedEvent other{of_lane(best.tick, offset), of_lane(best.generation, offset),
                             of_lane(best.low_id, offset), of_lane(best.high_id, offset),
                             of_lane(best.place, offset)};
    if (comes_before(other, best)) best = other;
  }
  if (threadIdx.x % 32 == 0) space[threadIdx.x / 32] = best;
  __syncthreads();
  for (const OrderedEvent& other : space) {
    if (comes_before(other, best)) best = other;
  }
  __syncthreads();
  return best;
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
