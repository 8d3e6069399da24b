// Method `exact` on the device: a block traces the ball's path through the hits of a window.
//
// Only what follows the first change is traced anew. Let P be the present path, and let a segment hold if a
// wall begins it, or if the solution has the hit that P was traced through there: the same parcel, on the
// same trajectory, at the same tick. Let h be any other hit of the solution. All hits of the solution were
// found on P, because clusters whose hits are on a part of the path that changes are solved again (see
// find_clusters_at_ball). So h lies on a segment of P, and on each segment before that the event with which
// it ends comes before the event that the parcel of h would have with the ball, as long as both kept their
// trajectories.
//
// Then the path begins with the segments up to the first one that does not hold, or to the one on which the
// first other hit lies, whichever is earlier. By induction: the ball is on a segment of these, as on P. The
// hits that are left are of three kinds. The one that P was traced through at the segment's end is there,
// with the same tick and generation, since these depend only on the two trajectories and on what led to them,
// and so is the wall. Those that P was traced through later were there for P, too, and came later. All others
// lie on a later segment, so they come later. So the next event is that of P, in its tick as in its
// generation and id, and it leads the ball to the next segment of P.
#pragma once

#include "cuda/exact/ball_trace.cuh"
#include "cuda/exact/event_order.cuh"

namespace pf::cuda {

__device__ __forceinline__ const SegmentCause* segment_causes(const StepContext& step) {
  return step.memory.segment_causes[step.state.ball_path];
}

__device__ __forceinline__ bool is_same(const Trajectory& a, const Trajectory& b) {
  return a.anchor.x == b.anchor.x && a.anchor.y == b.anchor.y && a.tick == b.tick &&
         __float_as_uint(a.velocity.x) == __float_as_uint(b.velocity.x) &&
         __float_as_uint(a.velocity.y) == __float_as_uint(b.velocity.y);
}

// Returns whether the path has the hit: begins its next segment, one of the first `num`, with it.
__device__ __forceinline__ bool has_hit(const StepContext& step, std::uint32_t num, const BallHit& hit) {
  const std::uint32_t k = hit.segment + 1;
  if (k >= num) return false;
  const BallSegment& segment = ball_path(step)[k];
  const SegmentCause& cause = segment_causes(step)[k];
  return segment.partner == hit.id && segment.begin == hit.tick &&
         cause.parcel_generation == hit.next_generation && is_same(cause.before, hit.before);
}

// Shared memory of the block.
struct PathHits {
  static constexpr std::uint32_t kMax = kMaxBallSegments / 2;
  static constexpr unsigned kWarps = kExactBlock / 32;
  static constexpr unsigned kPerThread = kMax / kExactBlock;

  std::uint32_t hit[kMax];                          // indices of the hits to trace the path through
  std::uint16_t segment[kMax];                      // that the hit begins on the present path; 0: none
  std::uint32_t is_begun[kMaxBallSegments / 32];    // bits: segments that one of the hits begins
  std::uint32_t num;                                // hits
  std::uint32_t num_kept;                           // leading segments that are not traced anew
  std::uint32_t num_segments, num_same, num_walls;  // of the new path
  std::uint32_t has_changed, is_bent;
  unsigned long long wall_event_hash;
  OrderedEvent first_of_warps[2][kWarps];
};

// In memory for lists of neighbours: nothing searches for these while the ball's path is traced.
template <class NearSpace>
__device__ __forceinline__ PathHits& path_hits(NearSpace& near) {
  static_assert(sizeof(PathHits) <= sizeof(near));
  return reinterpret_cast<PathHits&>(near);
}
static_assert(PathHits::kMax % kExactBlock == 0);

// ---- All threads of the block call these functions.

// Lists the hits for which belongs(hit) is true, and finds how many leading segments are kept, max_kept at
// the most.
template <class Belongs>
__device__ __forceinline__ void list_hits(const StepContext& step, PathHits& space, std::uint32_t max_kept,
                                          Belongs belongs) {
  ExactState& state = step.state;
  const BallHit* hits = step.memory.ball_hits;
  const BallSegment* path = ball_path(step);
  const std::uint32_t num_logged = min(state.num_ball_hits, step.memory.ball_hit_capacity);
  for (unsigned w = threadIdx.x; w < kMaxBallSegments / 32; w += kExactBlock) space.is_begun[w] = 0;
  if (threadIdx.x == 0) {
    space.num = 0;
    space.num_kept = max_kept;
  }
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < num_logged; k += kExactBlock) {
    const BallHit& hit = hits[k];
    if (!belongs(hit)) continue;
    const std::uint32_t place = atomicAdd(&space.num, 1U);
    if (place >= PathHits::kMax) continue;
    const std::uint32_t begun = has_hit(step, max_kept, hit) ? hit.segment + 1 : 0U;
    space.hit[place] = k;
    space.segment[place] = static_cast<std::uint16_t>(begun);
    if (begun != 0)
      atomicOr(&space.is_begun[begun / 32], 1U << begun % 32);
    else
      atomicMin(&space.num_kept, hit.segment + 1);
  }
  __syncthreads();
  for (std::uint32_t k = threadIdx.x + 1; k < max_kept; k += kExactBlock) {
    if (is_parcel(path[k].partner) && (space.is_begun[k / 32] >> k % 32 & 1U) == 0)
      atomicMin(&space.num_kept, k);
  }
  if (threadIdx.x == 0 && space.num > PathHits::kMax) state.solve_failed = 1;
  __syncthreads();
}

// Drops the hits that begin segments which are kept.
__device__ __forceinline__ void drop_kept_hits(PathHits& space) {
  const std::uint32_t num = min(space.num, PathHits::kMax);
  std::uint32_t hit[PathHits::kPerThread];
  bool is_left[PathHits::kPerThread];
#pragma unroll
  for (unsigned u = 0; u < PathHits::kPerThread; ++u) {
    const unsigned p = threadIdx.x + u * kExactBlock;
    is_left[u] = p < num && (space.segment[p] == 0 || space.segment[p] >= space.num_kept);
    hit[u] = is_left[u] ? space.hit[p] : kInvalidIndex;
  }
  __syncthreads();
  if (threadIdx.x == 0) space.num = 0;
  __syncthreads();
#pragma unroll
  for (unsigned u = 0; u < PathHits::kPerThread; ++u) {
    if (is_left[u]) space.hit[atomicAdd(&space.num, 1U)] = hit[u];
  }
  __syncthreads();
}

// Copies the segments that are kept to the new path. The last threads begin: the first ones trace.
__device__ __forceinline__ void copy_kept_segments(const StepContext& step, const PathHits& space) {
  const StepMemory& memory = step.memory;
  const std::uint32_t now = step.state.ball_path;
  for (std::uint32_t k = kExactBlock - 1 - threadIdx.x; k < space.num_kept; k += kExactBlock) {
    memory.ball_paths[now ^ 1U][k] = memory.ball_paths[now][k];
    memory.segment_causes[now ^ 1U][k] = memory.segment_causes[now][k];
  }
}

// Sums up the new path, and finds where it leaves the present one.
__device__ __forceinline__ void sum_up_path(const StepContext& step, PathHits& space) {
  ExactState& state = step.state;
  const BallSegment* old = ball_path(step);
  const BallSegment* path = step.memory.ball_paths[state.ball_path ^ 1U];
  for (std::uint32_t k = threadIdx.x + 1; k < space.num_segments; k += kExactBlock) {
    const BallSegment segment = path[k];
    if (k >= state.num_ball_segments || (k >= space.num_kept && !is_same(old[k], segment)))
      atomicMin(&space.num_same, k);
    const SegmentSummary summary = summary_of(step.c, state, segment);
    if (summary.is_bent) space.is_bent = 1;
    if (!summary.begins_at_wall) continue;
    atomicAdd(&space.num_walls, 1U);
    atomicAdd(&space.wall_event_hash, summary.wall_event_hash);
  }
}

// The first warps of the block trace: one for 32 hits.
struct TracingWarps {
  unsigned num;

  __device__ __forceinline__ void barrier() const { __barrier_sync_count(1, num * 32); }
};

// Hits that a thread looks after. They stay in memory: registers are few, and all but the first access find
// them in the cache.
struct OwnHits {
  static constexpr unsigned kNum = PathHits::kPerThread;

  const BallHit* hits;
  std::uint32_t indices[kNum];  // kInvalidIndex: none, or the ball has met it

  __device__ __forceinline__ OwnHits(const BallHit* logged, const PathHits& space) : hits(logged) {
#pragma unroll
    for (unsigned u = 0; u < kNum; ++u) {
      const unsigned p = threadIdx.x + u * kExactBlock;
      indices[u] = p < space.num ? space.hit[p] : kInvalidIndex;
    }
  }

  // The first of them that the ball would meet. Its place is its index.
  template <Boundary kBoundary>
  __device__ __forceinline__ OrderedEvent first(const ExactConstants& c, const TracedBall& it) const {
    OrderedEvent best;
#pragma unroll
    for (unsigned u = 0; u < kNum; ++u) {
      if (indices[u] == kInvalidIndex) continue;
      const BallHit& hit = hits[indices[u]];
      const Trajectory before = hit.before;
      const std::uint32_t tick = ball_collision_tick<kBoundary>(c, it.ball.trajectory, before);
      if (tick == kNoTick) continue;
      const std::uint32_t generation =
          max(generation_of_ball(it, tick),
              generation_at(tick, anchor_time(c.plan, before), hit.next_generation));
      const OrderedEvent event{tick, generation, hit.id, kBallPartner, indices[u]};
      if (comes_before(event, best)) best = event;
    }
    return best;
  }

  __device__ __forceinline__ void drop(std::uint32_t index) {
#pragma unroll
    for (unsigned u = 0; u < kNum; ++u) {
      if (indices[u] == index) indices[u] = kInvalidIndex;
    }
  }

  __device__ __forceinline__ bool has_any() const {
    bool has = false;
#pragma unroll
    for (unsigned u = 0; u < kNum; ++u) has |= indices[u] != kInvalidIndex;
    return has;
  }
};

// ---- the trace itself, by the first warps

// The first of the events that their threads hold. The two halves of first_of_warps take turns, so that one
// barrier is enough: a half is written again after the next barrier, before which all have read it.
__device__ __forceinline__ OrderedEvent first_of(const TracingWarps& warps, const OrderedEvent& event,
                                                 OrderedEvent (&first_of_warps)[PathHits::kWarps]) {
  OrderedEvent best = first_of_warp(event);
  if (warps.num == 1) return best;
  if (threadIdx.x % 32 == 0) first_of_warps[threadIdx.x / 32] = best;
  warps.barrier();
  for (unsigned w = 0; w < warps.num; ++w) {
    if (comes_before(first_of_warps[w], best)) best = first_of_warps[w];
  }
  return best;
}

// Traces the path on from the last segment that is kept. The next event is that which the ball would meet
// first on its present trajectory, as in the serial program. Each thread that takes part computes the ball
// for itself, which takes less time than to tell the others.
template <Boundary kBoundary>
__device__ __forceinline__ void trace_hits(const StepContext& step, PathHits& space) {
  const TracingWarps warps{min(max((space.num + 31) / 32, 1U), PathHits::kWarps)};
  if (threadIdx.x / 32 >= warps.num) return;
  const StepMemory& memory = step.memory;
  ExactState& state = step.state;
  const std::uint32_t buffer = state.ball_path, last = space.num_kept - 1;
  const BallSegment start = memory.ball_paths[buffer][last];
  TracedBall it{{start.trajectory, memory.segment_causes[buffer][last].end_velocity_mps},
                start.next_generation,
                space.num_kept};
  OwnHits own(memory.ball_hits, space);
  bool has_changed = false;
  for (unsigned turn = 0;; turn ^= 1U) {
    const OrderedEvent own_first = own.first<kBoundary>(step.c, it);
    const OrderedEvent first = first_of(warps, own_first, space.first_of_warps[turn]);
    Event hit;
    if (first.tick != kNoTick) hit = {first.tick, first.low_id, first.low_id, first.generation};
    const Event event = next_ball_event<kBoundary>(step.c, it, hit);
    if (event.tick == kNoTick || !has_room(state, it)) break;
    SegmentCause cause{};
    if (is_parcel(event.partner)) {
      const BallHit& logged = memory.ball_hits[first.place];
      cause = {{}, logged.before, logged.next_generation};
      apply_hit<kBoundary>(step.c, event, logged.before, it);
      has_changed |= logged.tick != event.tick;
      own.drop(first.place);
    } else {
      apply_to_ball(step.c, event.tick, event.partner, {}, it.ball);
    }
    it.next_generation = event.generation + 1;
    ++it.num_segments;
    if (threadIdx.x == 0) write_segment(memory, buffer ^ 1U, it, event, cause);
  }
  has_changed |= own.has_any();  // the ball does not meet that parcel
  if (has_changed) space.has_changed = 1;
  if (threadIdx.x != 0) return;
  space.num_segments = space.num_same = it.num_segments;
  state.ball_at_end = it.ball;
}

// ----

// Traces the path through the hits for which belongs(hit) is true. max_kept: leading segments of the present
// path that may be kept. Called by all threads of one block.
template <Boundary kBoundary, class Belongs>
__device__ void trace_ball_path(const StepContext& step, PathHits& space, std::uint32_t max_kept,
                                Belongs belongs) {
  ExactState& state = step.state;
  if (threadIdx.x == 0) {
    space.has_changed = 0;
    space.is_bent = 0;
    space.num_walls = 0;
    space.wall_event_hash = 0;
  }
  list_hits(step, space, max_kept, belongs);
  drop_kept_hits(space);
  if (space.num == 0 && space.num_kept == state.num_ball_segments) {
    if (threadIdx.x == 0) state.path_has_changed = 0;
    return;
  }
  copy_kept_segments(step, space);
  trace_hits<kBoundary>(step, space);
  __syncthreads();
  sum_up_path(step, space);
  __syncthreads();
  if (threadIdx.x != 0) return;
  const std::uint32_t num = space.num_segments;
  state.path_has_changed =
      space.has_changed != 0 || space.num_same < num || num != state.num_ball_segments ? 1U : 0U;
  state.num_same_segments = space.num_same;
  state.num_ball_segments = num;
  state.path_is_straight = space.is_bent == 0 ? 1U : 0U;
  state.num_wall_events = space.num_walls;
  state.wall_event_hash = space.wall_event_hash;
  state.ball_path ^= 1U;
}

// Makes the ball a member of a cluster, with all clusters of parcels that expect to hit it. Called by all
// threads of one block.
__device__ inline void make_ball_a_member(const StepContext& step) {
  if (threadIdx.x >= 32) return;
  std::uint32_t cluster = kInvalidIndex;
  if (threadIdx.x < step.state.num_ball_hits) {
    std::uint32_t& place = step.memory.ball_hits[threadIdx.x].cluster;
    place = cluster = representative_of(step, place);
  }
  const std::uint32_t name = warp_min(cluster);
  if (threadIdx.x != 0) return;
  step.state.ball_joins = 1;
  step.state.ball_owner = name;
}

// Prepares for the hits that parcels expect at the window's start. If they are few, the ball becomes a member
// of a cluster. Otherwise they are assumed: they were found on the path without hits, so that no segment
// which a hit begins is known to hold. Called by all threads of one block.
template <Boundary kBoundary>
__device__ void expect_hits(const StepContext& step, PathHits& space) {
  if (!step.has_participant()) return;
  if (step.state.num_ball_hits <= kMaxHitsOfMember) {
    make_ball_a_member(step);
    return;
  }
  trace_ball_path<kBoundary>(step, space, 1, [](const BallHit&) { return true; });
  __syncthreads();
  if (threadIdx.x != 0) return;
  step.state.num_ball_hits = 0;
  step.state.path_is_checked = 0;
}

}  // namespace pf::cuda
