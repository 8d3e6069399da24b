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

__device__ inline bool has_hit(const StepContext& step, std::uint32_t tick, std::uint32_t id) {
  const BallSegment* path = ball_path(step);
  for (std::uint32_t s = 1; s < step.state.num_ball_segments; ++s) {
    if (path[s].begin == tick && path[s].partner == id) return true;
  }
  return false;
}

// Tick at which a parcel hits the ball on the assumed path, or kNoTick. Of hits at one tick that with the lower id
// comes first. just_hit: the parcel's trajectory begins with a hit; it meets the ball after that. If the path does not
// have the hit yet, that cannot be told, and does not matter: the cluster will be solved again.
template <Boundary kBoundary>
__device__ std::uint32_t ball_path_tick(const StepContext& step, const Trajectory& parcel, std::uint32_t id,
                                        bool just_hit) {
  const ExactConstants& c = step.c;
  const BallSegment* path = ball_path(step);
  const std::uint32_t num = step.state.num_ball_segments;
  if (just_hit && step.has_participant() && !has_hit(step, parcel.tick - c.plan.start, id)) return kNoTick;
  if (num == 1) return ball_collision_tick<kBoundary>(c, path[0].trajectory, parcel);
  std::uint32_t first = 0;
  if (step.state.path_is_straight != 0) {
    // Whoever hits the path is within the margin of its first segment then: it comes there, or was there before.
    const RelativeMotion motion = motion_from_ball<kBoundary>(c, path[0].trajectory, parcel);
    const double near = c.run.ball_contact + kPathMargin;
    if (dot(motion.offset, motion.offset) > near * near) {
      const std::uint32_t tick = contact_tick(c.plan, motion, near);
      if (tick == kNoTick) return kNoTick;
      while (first + 1 < num && path[first + 1].begin < tick) ++first;
    }
  }
  const std::int32_t anchor = anchor_time(c.plan, parcel);
  for (std::uint32_t s = first; s < num; ++s) {
    const bool is_last = s + 1 == num;
    const std::uint32_t end = is_last ? kNoTick : path[s + 1].begin;
    const std::uint32_t partner = is_last ? kNoPartner : path[s + 1].partner;
    const auto end_time = static_cast<std::int64_t>(end);
    if (end_time < anchor || (end_time == anchor && partner <= id)) continue;
    const std::uint32_t tick = ball_collision_tick<kBoundary>(c, path[s].trajectory, parcel);
    if (tick != kNoTick && (tick < end || (tick == end && id <= partner))) return tick;
  }
  return kNoTick;
}

// The ball's trajectory before a hit by parcel `id` at a tick.
__device__ inline const BallTrajectory& ball_before(const StepContext& step, std::uint32_t tick, std::uint32_t id) {
  const BallSegment* path = ball_path(step);
  std::uint32_t s = step.state.num_ball_segments - 1;
  while (s > 0 && (path[s].begin > tick || (path[s].begin == tick && path[s].partner >= id))) --s;
  return path[s].trajectory;
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

// Traces the path through hits given in their order, into the other array. A hit happens when the parcel meets the ball
// on this path. Called by one thread.
template <Boundary kBoundary, class HitAt>
__device__ void trace_ball_path(const ExactConstants& c, const StepMemory& memory, ExactState& state,
                                std::uint32_t num_hits, HitAt hit_at) {
  const BallSegment* old = memory.ball_paths[state.ball_path];
  BallSegment* path = memory.ball_paths[state.ball_path ^ 1U];
  ExactBall ball = state.ball;
  path[0] = {ball.trajectory, 0, 0};
  bool changed = state.num_ball_segments == 0, bounces = false;
  double bend_mps = 0.0;  // along an axis
  std::uint32_t num = 1, next = 0;
  state.num_wall_events = 0;
  state.wall_event_hash = 0;
  while (true) {
    Event edge;
    if (c.plan.ball == BallRole::participant) keep_ball_edge_event<kBoundary>(c, ball.trajectory, edge);
    BallSegment segment;
    if (next < num_hits && hit_at(next).tick <= edge.tick) {
      const BallHit& hit = hit_at(next++);
      Trajectory parcel = hit.before;
      const std::uint32_t tick = ball_collision_tick<kBoundary>(c, ball.trajectory, parcel);
      changed = changed || tick != hit.tick;
      if (tick == kNoTick) continue;
      ClusterTally ignored;
      anchor_at<kBoundary>(c, parcel, tick);
      const BallReaction reaction = collide_with_ball<kBoundary>(c, ball.trajectory, tick, parcel, ignored);
      apply_to_ball(c, tick, kBallPartner, reaction, ball);
      segment = {ball.trajectory, tick, hit.id};
    } else if (edge.tick != kNoTick) {
      apply_to_ball(c, edge.tick, edge.partner, {}, ball);
      segment = {ball.trajectory, edge.tick, edge.partner};
      ++state.num_wall_events;
      const std::uint64_t at =
          state.progress.now + (static_cast<std::uint64_t>(edge.tick) << state.progress.tick_exponent);
      state.wall_event_hash += event_hash(at, edge.partner, kBallPartner);
      bounces = true;
    } else {
      break;
    }
    if (num == kMaxBallSegments) {
      state.solve_failed = 1;
      break;
    }
    const double surface_mps = surface_speed_mps(c.run.physics, ball.trajectory);
    if (surface_mps > c.plan.max_speed_mps)
      atomicMax(&state.too_fast_bits, __float_as_uint(static_cast<float>(surface_mps) * (1.0F + 1e-6F)));
    changed = changed || num >= state.num_ball_segments || old[num].begin != segment.begin ||
              old[num].partner != segment.partner || !is_same(old[num].trajectory, segment.trajectory);
    path[num++] = segment;
    const Vec2d bend = ball.trajectory.velocity_mps - state.ball.trajectory.velocity_mps;
    bend_mps = fmax(bend_mps, fmax(fabs(bend.x), fabs(bend.y)));
  }
  const double most = bend_mps * c.plan.units_per_tick * (c.plan.length - state.window_begin);
  state.path_is_straight = !bounces && most < 0.5 * kPathMargin ? 1U : 0U;
  state.path_has_changed = changed || num != state.num_ball_segments ? 1U : 0U;
  state.num_ball_segments = num;
  state.ball_path ^= 1U;
  state.ball_at_end = ball;
}

// Assumes that nothing hits the ball in the window. Called by one thread.
__device__ inline void start_ball_path(const RunConstants& run, const StepMemory& memory, ExactState& state) {
  state.num_ball_hits = 0;
  state.num_ball_segments = 0;
  state.path_is_checked = 1;
  if (state.plan.ball == BallRole::absent) return;
  ExactConstants c{run, state.plan};
  c.plan.length = state.window_end;
  const auto no_hit = [&](std::uint32_t) -> const BallHit& { return memory.ball_hits[0]; };
  if (run.physics.world.boundary == Boundary::walls) {
    trace_ball_path<Boundary::walls>(c, memory, state, 0, no_hit);
  } else {
    trace_ball_path<Boundary::open>(c, memory, state, 0, no_hit);
  }
}

// The hits of the present solution in their order, in a block's shared memory.
struct HitOrder {
  std::uint32_t found[kMaxBallSegments], order[kMaxBallSegments];  // indices of hits
  std::uint32_t num;
};

// Orders the hits for which belongs(hit) is true. Called by all threads of one block.
template <class Belongs>
__device__ void order_hits(const StepContext& step, HitOrder& space, Belongs belongs) {
  const BallHit* hits = step.memory.ball_hits;
  const std::uint32_t num_logged = min(step.state.num_ball_hits, step.memory.ball_hit_capacity);
  if (threadIdx.x == 0) space.num = 0;
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < num_logged; k += kExactBlock) {
    if (!belongs(hits[k])) continue;
    const std::uint32_t place = atomicAdd(&space.num, 1U);
    if (place < kMaxBallSegments) space.found[place] = k;
  }
  __syncthreads();
  const std::uint32_t num = min(space.num, kMaxBallSegments);
  for (std::uint32_t p = threadIdx.x; p < num; p += kExactBlock) {
    const BallHit& hit = hits[space.found[p]];
    std::uint32_t rank = 0;
    for (std::uint32_t q = 0; q < num; ++q) {
      const BallHit& other = hits[space.found[q]];
      const bool is_twin = other.tick == hit.tick && other.id == hit.id;
      if (other.tick < hit.tick || (other.tick == hit.tick && other.id < hit.id) || (is_twin && q < p)) ++rank;
    }
    space.order[rank] = space.found[p];
  }
  __syncthreads();
}

// Traces the path through ordered hits. Called by one thread.
template <Boundary kBoundary>
__device__ void trace_ball_path(const StepContext& step, const HitOrder& space) {
  const BallHit* hits = step.memory.ball_hits;
  if (space.num > kMaxBallSegments / 2) step.state.solve_failed = 1;
  trace_ball_path<kBoundary>(step.c, step.memory, step.state, min(space.num, kMaxBallSegments / 2),
                             [&](std::uint32_t k) -> const BallHit& { return hits[space.order[k]]; });
}

// Assumes the hits that parcels expect at the window's start. Called by all threads of one block.
template <Boundary kBoundary>
__device__ void expect_hits(const StepContext& step, HitOrder& space) {
  if (!step.has_participant() || step.state.num_ball_hits == 0) return;
  order_hits(step, space, [](const BallHit&) { return true; });
  if (threadIdx.x != 0) return;
  trace_ball_path<kBoundary>(step, space);
  step.state.num_ball_hits = 0;
  step.state.path_is_checked = 0;
}

}  // namespace pf::cuda
