// Method `exact` on the device, last stage of a step: the solution becomes the parcels' state.
#pragma once

#include "cuda/draw_parcel.cuh"
#include "cuda/exact/clusters.cuh"
#include "cuda/tally.cuh"

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
  const auto end = static_cast<std::int32_t>(step.c.plan.length);
  write_position(step, i, position_at<kBoundary>(step.c, trajectory, end), trajectory.velocity);
}

__device__ inline void add_tally(const ClusterTally& cluster, ClusterTally& sum) {
  sum.num_events += cluster.num_events;
  sum.num_collisions += cluster.num_collisions;
  sum.num_hits += cluster.num_hits;
  sum.num_retired += cluster.num_retired;
  sum.max_overlap = fmaxf(sum.max_overlap, cluster.max_overlap);
  sum.impulse_sum += cluster.impulse_sum;
  sum.ball_x += cluster.ball_x;
  sum.ball_y += cluster.ball_y;
  sum.ball_torque += cluster.ball_torque;
  sum.event_hash += cluster.event_hash;
}

// Adds the sums of a warp's threads to the block's tally, and the number of events to the step's.
__device__ inline void reduce_warp(const ClusterTally& sum, TallySlot& tally, ExactState& state) {
  if (!__any_sync(kWholeWarp, sum.num_events > 0)) return;
  const bool leads = threadIdx.x % 32 == 0;
  const auto add = [&](unsigned long long& to, unsigned long long value) {
    value = sum_over_warp(value);
    if (leads && value != 0) atomicAdd(&to, value);
  };
  const unsigned events = warp_add(sum.num_events);
  const unsigned retired = warp_add(sum.num_retired);
  const unsigned overlap = warp_max(__float_as_uint(sum.max_overlap));
  if (leads) {
    atomicAdd(&state.num_events, static_cast<unsigned long long>(events));
    if (retired != 0) atomicAdd(&tally.num_retired, retired);
    atomicMax(&tally.max_overlap_bits, overlap);
  }
  add(tally.num_collisions, sum.num_collisions);
  add(tally.impulse_sum, static_cast<unsigned long long>(sum.impulse_sum));
  add(tally.event_hash, sum.event_hash);
  const unsigned hits = warp_add(sum.num_hits);
  if (hits == 0) return;
  if (leads) atomicAdd(&tally.num_hits, hits);
  add(tally.ball_x, static_cast<unsigned long long>(sum.ball_x));
  add(tally.ball_y, static_cast<unsigned long long>(sum.ball_y));
  add(tally.ball_torque, static_cast<unsigned long long>(sum.ball_torque));
}

template <Boundary kBoundary>
__device__ void store(const StepContext& step, const Member& member) {
  const ParcelPointers& parcels = step.memory.trajectories;
  const std::uint32_t i = member.index;
  parcels.position[i] = member.trajectory.anchor;
  parcels.velocity[i] = member.trajectory.velocity;
  parcels.tick[i] = member.trajectory.tick;
  if (parcels.last_contact_tick) parcels.last_contact_tick[i] = member.last_contact_tick;
  write_end_position<kBoundary>(step, i, member.trajectory);
}

// Commits a block's part of a slice, which has num_members. Whole warps call it.
template <Boundary kBoundary>
__device__ void commit(const StepContext& step, const SlicePart& part, std::uint32_t num_members,
                       TallySlot& tally) {
  const StepMemory& memory = step.memory;
  const std::uint32_t first = part.part * kExactBlock + threadIdx.x;
  ClusterTally sum;
  for (std::uint32_t k = first; k < num_members; k += part.num_parts * kExactBlock) {
    const std::uint32_t slot = part.slice * memory.member_capacity + k;
    const Member member = memory.members[slot];
    if (memory.owner[member.index] == member.index) add_tally(memory.clusters[slot].tally, sum);
    if (member.has_changed) store<kBoundary>(step, member);
  }
  const bool adds_ball = part.slice == 0 && first == 0 && step.has_participant();
  if (adds_ball && step.state.ball_owner == kBallCluster)
    add_tally(cluster_of(step, kBallCluster).tally, sum);
  reduce_warp(sum, tally, step.state);
}

}  // namespace pf::cuda
