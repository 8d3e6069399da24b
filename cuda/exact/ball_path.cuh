// Method `exact` on the device: the path of a participating ball through a window.
//
// A hit changes the ball's velocity by some millionth of itself. So clusters are solved side by side against
// an assumed path, at first that through the hits that parcels expect at the window's start. The hits that
// the clusters have, in their order, give the path anew. Clusters that hit the ball where the path has
// changed are solved again against that, until no bit of it changes. Then every hit happened on the ball's
// true trajectory: the solution is that of the serial program.
#pragma once

#include "cuda/exact/clusters.cuh"
#include "cuda/half_warp.cuh"

namespace pf::cuda {

__device__ inline const BallSegment* ball_path(const StepContext& step) {
  return step.memory.ball_paths[step.state.ball_path];
}

// A path to compare parcels with. is_straight: it stays within kPathMargin of its first segment.
struct BallPath {
  const BallSegment* segments;
  std::uint32_t num;
  bool is_straight;
};

// The path that solvers assume.
__device__ __forceinline__ BallPath assumed_path(const StepContext& step) {
  const ExactState& state = step.state;
  return {ball_path(step), state.num_ball_segments, state.path_is_straight != 0};
}

// Path of a ball that is a member of a cluster, from the cluster's solution.
__device__ __forceinline__ BallPath solved_path(const StepContext& step) {
  const ExactState& state = step.state;
  return {step.memory.ball_paths[state.ball_path ^ 1U], state.num_solved_segments,
          state.solved_path_is_straight != 0};
}

// Returns whether the ball joins the cluster of the first parcel that hits it.
__device__ __forceinline__ bool ball_joins(const StepContext& step) { return step.state.ball_joins != 0; }

// The cluster that has the ball, or kInvalidIndex.
__device__ __forceinline__ std::uint32_t owner_of_ball(const StepContext& step) {
  const std::uint32_t owner = load_fresh(&step.state.ball_owner);
  return owner == kInvalidIndex ? owner : find_root(step, owner);
}

// Claims the ball for a cluster if it is free. Returns its owner before, kInvalidIndex if it was free.
__device__ __forceinline__ std::uint32_t claim_ball(const StepContext& step, std::uint32_t cluster) {
  const std::uint32_t owner = atomicCAS(&step.state.ball_owner, kInvalidIndex, cluster);
  return owner == kInvalidIndex ? owner : find_root(step, owner);
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
__device__ __forceinline__ PathHit hit_on_segment(const StepContext& step, const BallPath& path,
                                                  std::uint32_t s, const ParcelNearBall& parcel) {
  const ExactConstants& c = step.c;
  const BallSegment& segment = path.segments[s];
  const std::int32_t anchor = anchor_time(c.plan, parcel.trajectory);
  Event end;
  if (s + 1 < path.num) end = begin_of(path.segments[s + 1]);
  if (static_cast<std::int64_t>(end.tick) < anchor) return {};
  const std::uint32_t tick = ball_collision_tick<kBoundary>(c, segment.trajectory, parcel.trajectory);
  const std::uint32_t generation = max(generation_at(tick, anchor, parcel.next_generation),
                                       generation_at(tick, segment.trajectory.tick, segment.next_generation));
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

// Returns whether a parcel meets a path that stays within kPathMargin of its first segment. tick: it cannot
// be hit earlier.
template <Boundary kBoundary>
__device__ bool meets_straight_path(const StepContext& step, const BallTrajectory& first,
                                    const ParcelNearBall& parcel, std::uint32_t& tick) {
  tick = tick_near_ball<kBoundary>(step.c, first, parcel.trajectory, step.c.run.ball_contact + kPathMargin);
  return tick != kNoTick;
}

// The first hit of a parcel from a segment of the path on.
template <Boundary kBoundary>
__device__ PathHit hit_from_segment(const StepContext& step, const BallPath& path,
                                    const ParcelNearBall& parcel, std::uint32_t first) {
  if (path.is_straight && path.num > 1) {
    std::uint32_t tick = 0;
    if (!meets_straight_path<kBoundary>(step, path.segments[0].trajectory, parcel, tick)) return {};
    first = max(first, segment_before(path.segments, path.num, {tick, 0, 0}));
  }
  for (std::uint32_t s = first; s < path.num; ++s) {
    const PathHit hit = hit_on_segment<kBoundary>(step, path, s, parcel);
    if (hit.tick != kNoTick) return hit;
  }
  return {};
}

// The next hit of a parcel. After a hit it meets the ball as that left it; if the path does not have the hit
// yet, the next one cannot be told, and does not matter: the cluster will be solved again.
template <Boundary kBoundary>
__device__ PathHit hit_on_path(const StepContext& step, const ParcelNearBall& parcel) {
  const BallPath path = assumed_path(step);
  bool is_known = !parcel.just_hit || !step.has_participant();
  for (std::uint32_t s = 1; !is_known && s < path.num; ++s)
    is_known = begins_with_hit_of(step, path.segments[s], parcel);
  if (!is_known) return {};
  return hit_from_segment<kBoundary>(step, path, parcel, 0);
}

// The same by the lanes of half a warp for a parcel that they have in common. Whole warps call it; a half
// with is_real = false finds nothing.
template <Boundary kBoundary>
__device__ __forceinline__ PathHit hit_on_path_by_half_warp(const StepContext& step,
                                                            const ParcelNearBall& parcel, bool is_real) {
  const BallPath path = assumed_path(step);
  const std::uint32_t num = is_real ? path.num : 0U;
  const std::uint32_t max_num = warp_max(num);
  bool is_known = !parcel.just_hit || !step.has_participant();
  PathHit found;
  for (std::uint32_t base = 0; base < max_num; base += kHalfWarp) {
    const std::uint32_t s = base + threadIdx.x % kHalfWarp;
    const bool searches = s < num && found.tick == kNoTick;
    PathHit hit;
    if (searches) hit = hit_on_segment<kBoundary>(step, path, s, parcel);
    if (in_half_warp(searches && s > 0 && begins_with_hit_of(step, path.segments[s], parcel)) != 0)
      is_known = true;
    const unsigned hits = in_half_warp(hit.tick != kNoTick);
    const unsigned lane = hits != 0 ? __ffs(hits) - 1 : 0U;
    hit = {__shfl_sync(kWholeWarp, hit.tick, lane, kHalfWarp),
           __shfl_sync(kWholeWarp, hit.generation, lane, kHalfWarp), base + lane};
    if (found.tick == kNoTick && hits != 0) found = hit;
    if (__all_sync(kWholeWarp, found.tick != kNoTick || base + kHalfWarp >= num)) break;
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

}  // namespace pf::cuda
