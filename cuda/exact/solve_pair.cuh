// Method `exact` on the device: clusters of two parcels that collide once in the window, which most clusters
// are. A few threads solve each, without what larger clusters need. They leave a pair to solve_kernel if a
// third body might change its events.
#pragma once

#include "cuda/exact/clusters.cuh"

namespace pf::cuda {

// A parcel of a pair and its trajectory after their collision.
struct PairedParcel {
  std::uint32_t index, id, member_slot;
  Trajectory trajectory;  // the start trajectory, then the one after the collision
  float start_speed2;     // (m/s)^2
};

// A pair after its collision, as the threads of one of its parcels see it.
struct CollidedPair {
  PairedParcel mine;
  std::uint32_t other, other_slot;
  std::uint32_t tick;
  bool collides_again;
  ClusterTally tally;
};

__device__ inline PairedParcel paired_parcel(const StepContext& step, std::uint32_t i) {
  const Trajectory start = step.start_trajectory(i);
  return {i, step.id(i), step.memory.member_slot[i], start, dot(start.velocity, start.velocity)};
}

// There are no last contacts without a contact duration.
__device__ inline bool is_elastic(const StepContext& step, std::uint32_t i, std::uint32_t tick) {
  return step.c.plan.contact_duration_ticks != 0 &&
         is_in_contact(step.c.plan, tick, step.memory.trajectories.last_contact_tick[i]);
}

// mine, other: its parcels.
template <Boundary kBoundary>
__device__ __forceinline__ CollidedPair collide_pair(const StepContext& step, std::uint32_t tick,
                                                     PairedParcel mine, PairedParcel other) {
  const ExactConstants& c = step.c;
  anchor_at<kBoundary>(c, mine.trajectory, tick);
  anchor_at<kBoundary>(c, other.trajectory, tick);
  const bool elastic = is_elastic(step, mine.index, tick) || is_elastic(step, other.index, tick);
  const bool is_first = mine.id < other.id;
  Trajectory first = is_first ? mine.trajectory : other.trajectory;
  Trajectory second = is_first ? other.trajectory : mine.trajectory;
  ClusterTally tally;
  collide<kBoundary>(c, first, second, elastic, tally);
  tally.num_events = 1;
  tally.event_hash = event_hash(step.since_reset(tick), min(mine.id, other.id), max(mine.id, other.id));
  // Two parcels may be so fast that floats do not resolve how slowly they separate; then they collide again
  // at once.
  const bool collides_again = collision_tick<kBoundary>(c, first, second) != kNoTick;
  mine.trajectory = is_first ? first : second;
  return {mine, other.index, other.member_slot, tick, collides_again, tally};
}

// Returns whether nothing but its partner can change the events of a pair's parcel, as long as all other
// parcels stay on their start trajectories. Calls note(j) for the parcels near it that have events
// themselves. kLanes threads share the work.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes, class Note>
__device__ bool is_undisturbed(const StepContext& step, const PairedParcel& it, std::uint32_t partner,
                               NearList<kExactBlock>::Space& near_space, Note note) {
  const StepMemory& memory = step.memory;
  const ExactConstants& c = step.c;
  const Trajectory& now = it.trajectory;
  const Vec2i* positions = step.start_positions();
  const Vec2i here = positions[it.index];
  const float speed2 = fmaxf(it.start_speed2, dot(now.velocity, now.velocity));
  const float radius = search_radius(c, sqrtf(speed2) + static_cast<float>(c.plan.max_speed_mps));
  const Vec2i start = start_position<kBoundary>(c, now);
  NearList<kExactBlock> near{near_space};
  search<kBoundary, kReadOnly, kLanes>(step.launch.space, positions,
                                       {here, it.index, step.search_reach(radius), radius * radius},
                                       [&](std::uint32_t j) { near.push(j); });
  if (!near.holds_all()) return false;
  bool undisturbed = true;
  struct Neighbour {
    EventKey event;
    Vec2f velocity;
    Vec2i position;
  };
  const auto load = [&](std::uint32_t j) {
    return Neighbour{memory.events[j], memory.trajectories.velocity[j], positions[j]};
  };
  near.keep_if(load, [&](std::uint32_t j, const Neighbour& other) {
    if (j == partner) return false;
    if (tick_of(other.event) < c.plan.length) {
      if (partner_of(other.event) == it.index) undisturbed = false;
      note(j);
    }
    return may_collide(separation<kBoundary>(step.world(), start, other.position),
                       other.velocity - now.velocity, step.contact_distance(), step.units_in_step());
  });
  for (unsigned k = 0; undisturbed && k < near.num; ++k) {
    const Trajectory other = step.start_trajectory(near[k]);
    if (!is_retired(other.anchor) && collision_tick<kBoundary>(c, now, other) != kNoTick) undisturbed = false;
  }
  if (c.plan.ball != BallRole::absent && step.is_near_ball<kBoundary>(here)) undisturbed = false;
  if (may_reach_edge<kBoundary>(c, here)) {
    Event edge;
    keep_edge_event<kBoundary>(c, now, edge);
    if (edge.tick != kNoTick) undisturbed = false;
  }
  return undisturbed;
}

__device__ inline void note_neighbour_pair(const StepContext& step, std::uint32_t slice, std::uint32_t i,
                                           std::uint32_t j) {
  const StepMemory& memory = step.memory;
  const std::uint32_t k = atomicAdd(&memory.counts[slice].neighbour_pairs, 1U);
  if (k < memory.neighbour_pair_capacity) {
    memory.neighbour_pairs[static_cast<std::size_t>(slice) * memory.neighbour_pair_capacity + k] = {i, j};
  } else {
    step.state.list_overflow = 1;
  }
}

// Writes a parcel of a solved pair as a member. next_slot: of the pair's other member, or kInvalidIndex.
__device__ inline void publish_member(const StepContext& step, const PairedParcel& it, std::uint32_t tick,
                                      std::uint32_t representative, std::uint32_t next_slot) {
  Member member;
  member.trajectory = it.trajectory;
  member.index = it.index;
  member.id = it.id;
  member.next = next_slot;
  member.last_contact_tick = step.c.plan.start + tick;
  member.last_segment = kInvalidIndex;
  member.fastest_mps = 0.0F;
  member.has_changed = kChanged;
  member.next_generation = 1;
  step.memory.members[it.member_slot] = member;
  step.memory.owner[it.index] = representative;
}

// pair: as the threads of the representative see it.
__device__ inline void publish_cluster(const StepContext& step, const CollidedPair& pair) {
  const PairedParcel& mine = pair.mine;
  Cluster cluster;
  start_cluster(cluster, mine.index);
  cluster.members = mine.member_slot;
  cluster.solution = kSolvedAsPair;
  cluster.tally = pair.tally;
  step.memory.clusters[mine.member_slot] = cluster;
}

// Solves the pair of a representative by 2 * kLanes threads, one half for each parcel. Publishes the result,
// and leaves the pair to solve_kernel as a cluster if that is not certain. Whole warps call it; threads
// without a pair repeat another pair with is_real = false. Returns the square of the largest speed, (m/s)^2,
// in some of the threads.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes>
__device__ float solve_pair(const StepContext& step, std::uint32_t slice, std::uint32_t representative,
                            bool is_real, NearList<kExactBlock>::Space& near_space) {
  constexpr unsigned kTogether = 2 * kLanes;
  static_assert(kTogether < 32);
  const unsigned lane = threadIdx.x % kTogether;
  const unsigned all_lanes = ((1U << kTogether) - 1U) << (threadIdx.x % 32 - lane);  // of this pair
  const bool represents = lane < kLanes, leads = lane % kLanes == 0 && is_real;
  const EventKey event = step.memory.events[representative];
  const std::uint32_t partner = partner_of(event);
  const CollidedPair pair = collide_pair<kBoundary>(
      step, tick_of(event), paired_parcel(step, represents ? representative : partner),
      paired_parcel(step, represents ? partner : representative));
  const PairedParcel& mine = pair.mine;
  // Now, since what is written need not be kept in registers during the search.
  if (leads && represents) publish_cluster(step, pair);
  if (leads)
    publish_member(step, mine, pair.tick, representative, represents ? pair.other_slot : kInvalidIndex);
  const bool undisturbed =
      is_undisturbed<kBoundary, kReadOnly, kLanes>(step, mine, pair.other, near_space, [&](std::uint32_t j) {
        // A colliding pair of neighbours lies in both search circles. If both are in pairs, the one with the
        // lower index notes it; a larger cluster notes its own neighbours.
        if (j >= mine.index && is_real) note_neighbour_pair(step, slice, mine.index, j);
      });
  const unsigned solved = __ballot_sync(kWholeWarp, undisturbed && !pair.collides_again && is_real);
  if (!leads) return 0.0F;
  if ((solved & all_lanes) == all_lanes) return dot(mine.trajectory.velocity, mine.trajectory.velocity);
  join_cluster(step, mine.index, representative);
  return 0.0F;
}

// Forms the clusters of a part of a slice's active parcels, and solves the pairs among them. All threads of
// the block call it.
template <Boundary kBoundary, bool kReadOnly, unsigned kLanes>
__device__ void solve_pairs(const StepContext& step, const SlicePart& part, PairSpace& pairs,
                            NearList<kExactBlock>::Space& near_space) {
  constexpr unsigned kPairsAtOnce = kExactBlock / (2 * kLanes);
  const StepMemory& memory = step.memory;
  const std::uint32_t num_active = min(memory.counts[part.slice].active, memory.active.capacity);
  if (part.part == 0 && threadIdx.x == 0) memory.counts[part.slice].members = num_active;
  if (__syncthreads_or(static_cast<int>(load_fresh(&step.state.list_overflow))) != 0) return;
  float fastest2 = 0.0F;
  for (std::uint32_t first = part.part * kExactBlock; first < num_active;
       first += part.num_parts * kExactBlock) {
    form_clusters(step, part.slice, first, num_active, pairs);
    const std::uint32_t num = pairs.num_representatives;
    for (std::uint32_t base = 0; base < num; base += kPairsAtOnce) {
      const std::uint32_t k = base + threadIdx.x / (2 * kLanes);
      const std::uint32_t representative = pairs.representatives[min(k, num - 1)];
      fastest2 = fmaxf(fastest2, solve_pair<kBoundary, kReadOnly, kLanes>(step, part.slice, representative,
                                                                          k < num, near_space));
    }
  }
  const unsigned fastest = warp_max(__float_as_uint(fastest2));
  if (threadIdx.x % 32 == 0 && fastest != 0) atomicMax(&step.state.fastest_after_bits, fastest);
}

}  // namespace pf::cuda
