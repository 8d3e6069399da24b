// Method `exact` on the device: clusters are formed, and those of two parcels that meet once in the step,
// which most are, solved at once by a few threads each, without what larger clusters need; whatever these are
// not sure of is left to exact_clusters.cuh.
#pragma once

#include "cuda/exact/clusters.cuh"

namespace pf {

template <class T>
__device__ void exchange(T& a, T& b) {
  const T kept = a;
  a = b;
  b = kept;
}

// A parcel as it is before it meets another.
struct PairedParcel {
  std::uint32_t index, id;
  std::uint32_t member_slot;  // among the members
  Trajectory trajectory;
  Vec2i at;  // at the step's begin
};

__device__ inline PairedParcel paired_parcel(const ExactArrays& a, const Vec2i* present, std::uint32_t i) {
  return {i, a.trajectories.id[i], a.member_slot[i], trajectory_of(a, i), present[i]};
}

// Whether nothing can happen any more to a parcel of a pair, which is on the line `now` since their meeting,
// as long as the others keep to theirs; and nobody was to meet it before. on_border(j): near it, and will
// change its line. kLanes threads share the work.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes, class OnBorder>
__device__ bool is_left_alone(const ExactConstants& c, const ExactLaunch& launch, const ExactState& state,
                              const PairedParcel& it, std::uint32_t partner, const Trajectory& now,
                              NearList<kExactBlock>::Space& near_space, OnBorder on_neighbour_pair) {
  const ExactArrays& a = launch.arrays;
  const World& world = c.run.physics.world;
  const Vec2i* present = a.present[state.current_buffer];
  const float speed2 = fmaxf(dot(it.trajectory.velocity, it.trajectory.velocity), dot(now.velocity, now.velocity));
  const auto contact = static_cast<float>(c.run.contact_distance);
  const auto per_mps = static_cast<float>(c.plan.units_per_tick * c.plan.length);
  const float fastest = sqrtf(speed2) + static_cast<float>(c.plan.max_speed_mps);
  const float distance = (contact + fastest * per_mps) * kAbove + static_cast<float>(kRoundingMargin);
  const float reach = distance + static_cast<float>(state.progress.max_displacement) * kAbove;
  const Vec2i begin = start_position<kBoundary>(c, now);
  NearList<kExactBlock> near{near_space};
  search<kBoundary, kReadOnly, kLanes>(launch.space, present, it.at, it.index, saturated(reach),
                                       distance * distance, [&](std::uint32_t j, Vec2i) { near.push(j); });
  if (!near.holds_all()) return false;
  bool alone = true;
  near.keep_if([&](std::uint32_t j) {
    const std::uint32_t theirs = a.event_partner[j];
    const Vec2f velocity = a.trajectories.velocity[j];
    const Vec2i there = present[j];
    if (j == partner) return false;
    if (theirs == it.index) alone = false;
    if (theirs != kNoPartner) on_neighbour_pair(j);
    return may_collide(separation<kBoundary>(world, begin, there), velocity - now.velocity, contact, per_mps);
  });
  for (unsigned k = 0; alone && k < near.num; ++k) {
    const Trajectory there = trajectory_of(a, near[k]);
    if (!is_retired(there.anchor) && collision_tick<kBoundary>(c, now, there) != kNoTick) alone = false;
  }
  if (c.plan.ball != BallRole::absent && is_in<kBoundary>(state.ball_neighbourhood, world, it.at)) alone = false;
  if (may_reach_edge<kBoundary>(c, it.at)) {
    Event edge;
    keep_edge_event<kBoundary>(c, now, edge);
    if (edge.tick != kNoTick) alone = false;
  }
  return alone;
}

// What the block's threads share.
struct PairSpace {
  std::uint32_t representatives[kExactBlock];  // of pairs
  std::uint32_t num_representatives;
};

__device__ inline void start_record(ClusterRecord& record, std::uint32_t name) {
  record = {};
  record.members = record.merged = kInvalidIndex;
  record.parent = name;
  record.claimed = kInvalidIndex;
}

// The parcel that the cluster of i is called by. Earliest events lead from parcel to parcel, each to an
// earlier one, and end with two that are each other's or with a parcel's own.
__device__ inline std::uint32_t representative_of(const ExactArrays& a, std::uint32_t i) {
  while (true) {
    const std::uint32_t partner = a.event_partner[i];
    if (!is_parcel(partner)) return i;
    if (a.event_partner[partner] == i) return i < partner ? i : partner;
    i = partner;
  }
}

// Makes parcel i a member of a cluster that is solved later.
__device__ inline void leave_to_others(const ExactArrays& a, ExactState& state, std::uint32_t i,
                                       std::uint32_t representative) {
  const std::uint32_t place = a.member_slot[i];
  a.owner[i] = representative;
  a.members[place].index = i;
  a.members[place].next = atomicExch(&a.list_head[representative], place);
  if (representative != i) return;
  start_record(a.records[place], i);
  a.representatives.items[atomicAdd(&state.num_representatives, 1U)] = i;  // they are no more than the active ones
}

// Forms clusters of a part of a segment's active parcels, and solves pairs among these, 2 * kLanes threads
// each. All threads of the block call it.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes>
__device__ void solve_pairs(const ExactConstants& c, const ExactLaunch& launch, std::uint32_t slice,
                            std::uint32_t part, std::uint32_t num_parts, PairSpace& space,
                            NearList<kExactBlock>::Space& near_space) {
  constexpr unsigned kTogether = 2 * kLanes;
  static_assert(kTogether < 32);
  ExactState& state = *launch.state;
  const ExactArrays& a = launch.arrays;
  if (__syncthreads_or(static_cast<int>(load_fresh(&state.list_overflow))) != 0) return;
  if (slice == 0 && part == 0 && threadIdx.x == 0 && c.plan.ball == BallRole::participant)
    start_record(record_of(a, kBallCluster), kBallCluster);
  const unsigned lane = threadIdx.x % kTogether;
  const unsigned all_lanes = ((1U << kTogether) - 1U) << (threadIdx.x % 32 - lane);  // of this pair
  const bool of_first = lane < kLanes;
  const Vec2i* present = a.present[state.current_buffer];
  const std::uint32_t num_active = min(a.counts[slice].active, a.active.capacity);
  float fastest2 = 0.0F;
  for (std::uint32_t base = part * kExactBlock; base < num_active; base += num_parts * kExactBlock) {
    __syncthreads();
    if (threadIdx.x == 0) space.num_representatives = 0;
    __syncthreads();
    if (base + threadIdx.x < num_active) {
      const std::uint32_t i =
          a.active.items[static_cast<std::size_t>(slice) * a.active.capacity + base + threadIdx.x];
      const std::uint32_t partner = a.event_partner[i];
      const bool is_pair = is_parcel(partner) && a.event_partner[partner] == i;
      if (!is_pair) {
        leave_to_others(a, state, i, representative_of(a, i));
      } else if (i < partner) {
        space.representatives[atomicAdd(&space.num_representatives, 1U)] = i;
      }
    }
    __syncthreads();
    const std::uint32_t num_representatives = space.num_representatives;
    for (std::uint32_t first = 0; first < num_representatives; first += kExactBlock / kTogether) {
      const std::uint32_t k = first + threadIdx.x / kTogether;
      const std::uint32_t name = space.representatives[min(k, num_representatives - 1)];
      const std::uint32_t tick = a.event_tick[name];
      PairedParcel one = paired_parcel(a, present, name);
      PairedParcel two = paired_parcel(a, present, a.event_partner[name]);
      if (two.id < one.id) exchange(one, two);
      Trajectory one_trajectory = one.trajectory, two_trajectory = two.trajectory;
      anchor_at<kBoundary>(c, one_trajectory, tick);
      anchor_at<kBoundary>(c, two_trajectory, tick);
      const auto in_contact_time = [&](std::uint32_t i) {
        return c.plan.contact_duration_ticks != 0 && c.plan.start + tick - a.trajectories.last_contact_tick[i] <= c.plan.contact_duration_ticks;
      };
      EventSums sum;
      collide<kBoundary>(c, one_trajectory, two_trajectory, in_contact_time(one.index) || in_contact_time(two.index),
                         sum);
      // (Of two so fast that a float cannot tell how little they part, an event may repeat at once.)
      const bool is_over = collision_tick<kBoundary>(c, one_trajectory, two_trajectory) == kNoTick;
      const PairedParcel& mine = of_first ? one : two;
      const PairedParcel& other = of_first ? two : one;
      const Trajectory& now = of_first ? one_trajectory : two_trajectory;
      const bool alone = is_left_alone<kBoundary, kReadOnly, kLanes>(
          c, launch, state, mine, other.index, now, near_space, [&](std::uint32_t j) {
            // Of two pairs one notes it, and a larger cluster does: who may meet is within the boxes of both.
            if (j < mine.index || k >= num_representatives) return;
            const std::uint32_t place = atomicAdd(&a.counts[slice].neighbour_pairs, 1U);
            if (place < a.neighbour_pair_capacity) {
              a.neighbour_pairs[static_cast<std::size_t>(slice) * a.neighbour_pair_capacity + place] = {mine.index, j};
            } else {
              state.list_overflow = 1;
            }
          });
      const unsigned left_alone = __ballot_sync(kWholeWarp, alone && is_over && k < num_representatives);
      if ((left_alone & all_lanes) != all_lanes) {
        if (lane % kLanes == 0 && k < num_representatives) leave_to_others(a, state, mine.index, name);
        continue;
      }
      if (lane % kLanes == 0) {
        ClusterMember member;
        member.trajectory = now;
        member.index = mine.index;
        member.id = mine.id;
        member.next = mine.index == name ? other.member_slot : kInvalidIndex;
        member.last_contact_tick = c.plan.start + tick;
        member.segments = kInvalidIndex;
        member.fastest_mps = 0.0F;
        member.has_changed = 1;
        a.members[mine.member_slot] = member;
        a.owner[mine.index] = name;
        fastest2 = fmaxf(fastest2, dot(now.velocity, now.velocity));
      }
      if (lane == 0) {
        const std::uint32_t place = one.index == name ? one.member_slot : two.member_slot;
        ClusterRecord record;
        start_record(record, name);
        record.members = place;
        record.is_solved = kSolvedAsPair;
        record.sum = sum;
        record.sum.num_events = 1;
        record.sum.event_hash = event_hash(since_reset(state, tick), one.id, two.id);
        a.records[place] = record;
      }
    }
  }
  const unsigned fastest = warp_max(__float_as_uint(fastest2));
  if (threadIdx.x % 32 == 0 && fastest != 0) atomicMax(&state.fastest_after_bits, fastest);
}

}  // namespace pf
