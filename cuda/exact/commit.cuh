// Method `exact` on the device, last stage of a window: the solution becomes the parcels' state.
#pragma once

#include "cuda/exact/clusters.cuh"
#include "cuda/exact/predict.cuh"
#include "cuda/tally.cuh"

namespace pf::cuda {

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
__device__ void store(const StepContext& step, const Member& member, bool step_goes_on) {
  const ParcelPointers& parcels = step.memory.trajectories;
  const std::uint32_t i = member.index;
  const Trajectory& now = member.trajectory;
  parcels.position[i] = now.anchor;
  parcels.velocity[i] = now.velocity;
  parcels.tick[i] = now.tick;
  const float fastest2 = fmaxf(dot(now.velocity, now.velocity), member.fastest_mps * member.fastest_mps);
  if (!is_retired(now.anchor)) raise_bound_of<kBoundary>(step, now.anchor, fastest2);
  if (parcels.last_contact_tick) parcels.last_contact_tick[i] = member.last_contact_tick;
  write_end_position<kBoundary>(step, i, now);
  if (step_goes_on)
    step.memory.positions[step.state.current_buffer][i] =
        is_retired(now.anchor) ? now.anchor : start_position<kBoundary>(step.c, now);
}

// Commits a block's part of a slice, which has num_members. Whole warps call it. step_goes_on: other windows
// follow; the members whose next event must be predicted are marked.
template <Boundary kBoundary>
__device__ void commit(const StepContext& step, const SlicePart& part, std::uint32_t num_members,
                       bool step_goes_on, TallySlot& tally) {
  const StepMemory& memory = step.memory;
  const std::uint32_t first = part.part * kExactBlock + threadIdx.x;
  ClusterTally sum;
  std::uint32_t num_pairs = 0;
  for (std::uint32_t k = first; k < num_members; k += part.num_parts * kExactBlock) {
    const std::uint32_t slot = part.slice * memory.member_capacity + k;
    const Member member = memory.members[slot];
    if (memory.owner[member.index] == member.index) {
      add_tally(memory.clusters[slot].tally, sum);
      if (memory.clusters[slot].solution == kSolvedAsPair) ++num_pairs;
    }
    if (member.has_changed) store<kBoundary>(step, member, step_goes_on);
    if (step_goes_on) {
      EventKey& event = memory.events[member.index];
      const bool was_due = !member.has_changed && tick_of(event) < step.state.window_end;
      if (was_due) memory.members[slot].has_changed = kWasDue;
      if (was_due || member.has_changed) event = kNoEventKey;
    }
  }
  if (part.slice == 0 && first == 0 && step.has_participant()) {
    sum.num_events += step.state.num_wall_events;
    sum.event_hash += step.state.wall_event_hash;
  }
  reduce_warp(sum, tally, step.state);
  num_pairs = warp_add(num_pairs);
  if (threadIdx.x % 32 == 0 && num_pairs != 0)
    atomicAdd(&step.state.num_events_solved, static_cast<unsigned long long>(num_pairs));
}

// ---- kept events, if the step goes on

__device__ inline bool comes_before(const StepContext& step, EventKey a, EventKey b) {
  return pf::comes_before(a, b, [&](std::uint32_t partner) { return step.id_of_partner(partner); });
}

// Parcel i keeps the event if it comes before the one that it has.
__device__ inline void keep_if_earlier(const StepContext& step, std::uint32_t i, EventKey event) {
  EventKey& kept = step.memory.events[i];
  EventKey old = load_fresh(&kept);
  while (comes_before(step, event, old)) {
    const EventKey before = atomicCAS(&kept, old, event);
    if (before == old) {
      atomicMin(&step.memory.earliest[i / kTile], tick_of(event));
      return;
    }
    old = before;
  }
}

// So many shares of some members each has the slice with the most of them. Whole warps call it.
__device__ inline std::uint32_t num_shares_of_members(const StepMemory& memory, std::uint32_t members) {
  std::uint32_t largest = 0;
  for (std::uint32_t s = threadIdx.x % 32; s < memory.num_slices; s += 32)
    largest = max(largest, memory.counts[s].members);
  return (warp_max(largest) + members - 1) / members;
}

// Predicts the marked members, after all trajectories are committed, each by a team. Each parcel that a
// changed one will meet learns of it. Members no longer belong to clusters. The grid's warps call it but for
// the first one of the first block. Slices differ much in how many members they have, so a warp takes a few
// of one slice, then of another.
template <Boundary kBoundary>
__device__ void predict_members(const StepContext& step, NearList<kExactBlock>::Space& near_space) {
  constexpr unsigned kTeamsOfWarp = 32 / kLanesOfParcel;
  const StepMemory& memory = step.memory;
  const bool leads = threadIdx.x % kLanesOfParcel == 0;
  const unsigned team = threadIdx.x % 32 / kLanesOfParcel;
  const std::uint32_t num_slices = gridDim.x, num_shares = num_shares_of_members(memory, kTeamsOfWarp);
  const std::uint32_t warp = blockIdx.x + threadIdx.x / 32 * num_slices;
  const std::uint32_t num_warps = num_slices * (kExactBlock / 32) - 1;
  for (std::uint32_t k = warp - 1; k < num_shares * num_slices; k += num_warps) {
    const std::uint32_t slice = k % num_slices, base = k / num_slices * kTeamsOfWarp;
    const std::uint32_t num_members = memory.counts[slice].members;
    if (base >= num_members) continue;
    const bool is_member = base + team < num_members;
    const Member& member = memory.members[slice * memory.member_capacity + (is_member ? base + team : base)];
    const std::uint32_t i = member.index;
    if (leads) memory.owner[i] = kInvalidIndex;
    const bool has_changed = member.has_changed != kUnchanged && member.has_changed != kWasDue;
    const Trajectory own = step.start_trajectory(i);
    const bool is_wanted = is_member && member.has_changed != kUnchanged && !is_retired(own.anchor);
    Event best;
    visit_collisions_by_teams<kBoundary>(step, is_wanted && step.c.run.physics.parcels.contacts, i, own,
                                         near_space, [&](std::uint32_t j, std::uint32_t tick) {
                                           if (tick == kNoTick) return;
                                           step.keep_collision(tick, j, best);
                                           if (has_changed) keep_if_earlier(step, j, event_key(tick, i));
                                         });
    if (!is_wanted) continue;
    if (leads) keep_edge_and_frozen_ball<kBoundary>(step, i, own, best);
    if (best.tick != kNoTick) keep_if_earlier(step, i, event_key(best.tick, best.partner));
    if (leads && is_near_participant<kBoundary>(step, i)) memory.earliest[i / kTile] = 0;
  }
}

}  // namespace pf::cuda
