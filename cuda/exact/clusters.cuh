// Method `exact` on the device: what those that solve clusters share.
#pragma once

#include <cooperative_groups.h>

#include "cuda/architecture.cuh"
#include "cuda/draw_parcel.cuh"
#include "cuda/exact/step_state.cuh"

namespace pf {

namespace cg = cooperative_groups;

constexpr unsigned kExactBlock = 256;
constexpr unsigned kWholeWarp = 0xFFFFFFFFU;
constexpr float kAbove = 1.0F + 1e-5F;  // more than the roundings of a bound in float

__device__ inline Trajectory trajectory_of(const ExactArrays& a, std::uint32_t i) {
  return {a.trajectories.position[i], a.trajectories.velocity[i], a.trajectories.tick[i]};
}

template <class Real>
__device__ std::int32_t saturated(Real units) {
  return static_cast<std::int32_t>(units < Real{1.0e9} ? units : Real{1.0e9});
}

// Square of a distance, as the filter of a search: a little above it, whatever float makes of it.
__device__ inline float filter_of(double distance) {
  return static_cast<float>(distance * distance * (1.0 + 1e-5));
}

__device__ inline void keep_collision(Event& best, std::uint32_t tick, std::uint32_t j,
                                    const std::uint32_t* id) {
  if (tick <= best.tick && tick != kNoTick) keep_earlier(best, {tick, j, id[j]});
}

__device__ inline std::uint32_t load_fresh(const std::uint32_t* word) {
  return *const_cast<const volatile std::uint32_t*>(word);
}

__device__ inline ClusterRecord& record_of(const ExactArrays& a, std::uint32_t cluster) {
  if (cluster == kBallCluster) return a.records[static_cast<std::size_t>(a.num_slices) * a.member_capacity];
  return a.records[a.member_slot[cluster]];
}

// The cluster that absorbed this one, or itself.
__device__ inline std::uint32_t holder_of(const ExactArrays& a, std::uint32_t cluster) {
  if (cluster == kBallCluster) return cluster;
  const ClusterRecord& record = record_of(a, cluster);
  return record.members == kInvalidIndex ? record.parent : cluster;
}

// Sets of clusters as trees; the lowest name is the root.
__device__ inline std::uint32_t find_root(const ExactArrays& a, std::uint32_t cluster) {
  while (true) {
    const std::uint32_t next = load_fresh(&record_of(a, cluster).parent);
    if (next == cluster) return cluster;
    cluster = next;
  }
}
__device__ inline void union_sets(const ExactArrays& a, std::uint32_t p, std::uint32_t q) {
  while (true) {
    p = find_root(a, p);
    q = find_root(a, q);
    if (p == q) return;
    const std::uint32_t low = p < q ? p : q, high = p < q ? q : p;
    if (atomicCAS(&record_of(a, high).parent, high, low) == high) return;
  }
}

// Counts of a block's items in its segments; and whether it solves the rest alone: 0 or 1.
struct BlockCounts {
  std::uint32_t members, segments, neighbour_pairs;
  std::uint32_t alone;
};

// Clusters that have to be solved as one, or one of them by a whole block.
__device__ inline void add_conflict(const ExactArrays& a, const BlockCounts& counts, ExactState& state,
                                    std::uint32_t p, std::uint32_t q) {
  const std::uint32_t place = atomicAdd(&state.num_conflicts[counts.alone], 1U);
  if (place < a.conflict_capacity) {
    a.conflicts[place] = {p, q};
  } else {
    state.solve_failed = 1;
  }
}

// A parcel as it is at the begin of the step.
__device__ inline ClusterMember member_at_start(const ExactArrays& a, std::uint32_t i) {
  ClusterMember now;
  now.index = i;
  now.id = a.trajectories.id[i];
  now.trajectory = trajectory_of(a, i);
  const std::uint32_t partner = a.event_partner[i];
  now.event = {a.event_tick[i], partner, is_parcel(partner) ? a.trajectories.id[partner] : partner};
  now.last_contact_tick = a.trajectories.last_contact_tick ? a.trajectories.last_contact_tick[i] : 0U;
  now.next = kInvalidIndex;
  now.segments = kInvalidIndex;
  now.fastest_mps = sqrtf(dot(now.trajectory.velocity, now.trajectory.velocity)) * (1.0F + 1e-6F);
  now.has_changed = 0;
  return now;
}

// A tick of the step, in ticks of the reference speed.
__device__ inline std::uint64_t since_reset(const ExactState& state, std::uint32_t tick) {
  return state.progress.now + (static_cast<std::uint64_t>(tick) << state.progress.tick_exponent);
}

// A load that starts where it stands in the program, not where its value is needed.
__device__ __forceinline__ std::uint32_t load_early(const std::uint32_t* from) {
  std::uint32_t value;
  asm volatile("ld.global.u32 %0, [%1];" : "=r"(value) : "l"(from) : "memory");
  return value;
}
__device__ __forceinline__ double load_early(const double* from) {
  double value;
  asm volatile("ld.global.f64 %0, [%1];" : "=d"(value) : "l"(from) : "memory");
  return value;
}

// The constants of the step in hand.
__device__ __forceinline__ ExactConstants constants_of(const ExactLaunch& launch) {
  ExactConstants c{launch.run, launch.state->plan};
  c.plan.start = load_early(&launch.state->plan.start);
  c.plan.length = load_early(&launch.state->plan.length);
  c.plan.max_speed_mps = load_early(&launch.state->plan.max_speed_mps);
  return c;
}

// Notes parcels of two clusters that are near each other.
__device__ __forceinline__ void add_neighbour_pair(const ExactArrays& a, BlockCounts& counts, ExactState& state,
                                           std::uint32_t i, std::uint32_t j) {
  const std::uint32_t place = atomicAdd(&counts.neighbour_pairs, 1U);
  if (place < a.neighbour_pair_capacity) {
    a.neighbour_pairs[static_cast<std::size_t>(blockIdx.x) * a.neighbour_pair_capacity + place] = {i, j};
  } else {
    state.solve_failed = 1;
  }
}

// A member goes on along `now` from an event at `tick` on; the line before, if an event led to that too, is
// kept.
__device__ __forceinline__ void set_trajectory(const ExactArrays& a, BlockCounts& counts, ExactState& state,
                                            const Trajectory& now, std::uint32_t tick, ClusterMember& it,
                                            EventSums& sum) {
  if (it.has_changed) {
    const std::uint32_t place = atomicAdd(&counts.segments, 1U);
    if (place < a.segment_capacity) {
      const std::uint32_t at = blockIdx.x * a.segment_capacity + place;
      a.segments[at] = {it.trajectory, tick, it.segments};
      it.segments = at;
    } else {
      state.solve_failed = 1;
    }
  }
  const float speed2 = dot(now.velocity, now.velocity);
  it.trajectory = now;
  it.has_changed = 1;
  it.fastest_mps = fmaxf(it.fastest_mps, sqrtf(speed2) * (1.0F + 1e-6F));
  sum.fastest2 = fmaxf(sum.fastest2, speed2);
}

}  // namespace pf
