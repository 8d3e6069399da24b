// Method `exact` on the device: the members of a cluster that the threads of a block solve together.
#pragma once

#include "cuda/exact/ball_trace.cuh"
#include "cuda/exact/event_order.cuh"
#include "cuda/exact/solve_common.cuh"

namespace pf::cuda {

// Parcels outside a cluster that a member of it may meet in the window, in an array that a team of threads or
// a member has. Indices, with these bits.
constexpr std::uint32_t kForeign = 1U << 31U;  // belonged to another cluster when the list was made
constexpr std::uint32_t kNoted = 1U << 30U;    // noted as a pair of neighbours
constexpr std::uint32_t kIndexBits = kNoted - 1;

// Result of a comparison with a member.
struct ToldEvent {
  std::uint32_t tick, generation;
};

// Results of the warps of a block in a turn of predictions, if each has all members.
struct WarpResults {
  alignas(16) Event told[2][32];  // of each member with one that the event changes
  alignas(16) Event best[kExactBlock / 32], at_ball[kExactBlock / 32];
  std::uint32_t is_crowded;  // 1 if a list has no room
};

// Shared memory of a ball that is a member of the cluster.
struct BlockBall {
  static constexpr unsigned kMaxOutside = 192;

  // A parcel outside, on its start trajectory. index: kInvalidIndex if it has joined.
  struct Outside {
    std::uint32_t index, id;
  };

  TracedBall now;
  Event event;  // the next one; its partner is a parcel or a wall
  Outside outside[kMaxOutside];
  std::uint32_t num_outside;  // with more than there is room for, all parcels near the ball are compared
  std::uint32_t is_bent;      // 1 if it leaves the straight path that the list was made for
};

// Shared memory of the block. A place is an index into the table.
struct BlockSpace {
  static constexpr unsigned kCapacity = 3072;
  static constexpr unsigned kHot = 32;      // members that lie here; the others lie in their slots
  static constexpr unsigned kMaxNear = 48;  // parcels in the list of one of them
  static constexpr unsigned kTeam = 64;     // threads that predict one member
  static constexpr unsigned kTeams = kExactBlock / kTeam;
  static constexpr unsigned kMaxPiece = 2 * kTeam;
  static constexpr unsigned kWarps = kExactBlock / 32;
  static constexpr std::uint16_t kNotListed = 0xFFFF;
  static constexpr unsigned kNumChanged = 2;  // members flagged first: those of the event

  std::uint32_t table[kCapacity];        // slots of the members
  std::uint16_t flagged[kCapacity + 2];  // places of members to predict; the first two are those of the event
  Member hot[kHot];
  std::uint32_t near[kHot][kMaxNear];
  std::uint16_t num_near[kHot];  // or kNotListed
  std::uint32_t num_members, num_flagged;
  std::uint32_t other;    // cluster that stopped this one
  std::uint32_t joined;   // place of the parcel that joined last, or kInvalidIndex
  std::uint32_t partner;  // place of the event's partner, or kInvalidIndex
  unsigned long long event_hash;
  OrderedEvent first_of_warps[kWarps];
  // Scratch of the teams.
  std::uint32_t piece[kTeams][kMaxPiece];
  std::uint32_t num_in_piece[kTeams];
  ToldEvent told[2][kTeam];
  Event best[kWarps], at_ball[kWarps];  // of each warp
  std::uint32_t knows_hit[kWarps];
  WarpResults results[2];
  BlockBall ball;
  std::uint32_t ball_joins;  // 1 if the cluster must be solved with the ball
};

// All threads of the block call the functions of this struct together, unless noted; the first one writes.
struct BlockMembers {
  static constexpr unsigned kCapacity = BlockSpace::kCapacity;
  static constexpr unsigned kHot = BlockSpace::kHot;

  const StepContext& step;
  const StepMemory& memory;
  SliceCounts& counts;
  BlockSpace& space;
  std::uint32_t cluster = 0;
  std::uint32_t attempt = 0;
  std::uint32_t num_segments = 0, num_neighbour_pairs = 0;  // in the slices at the start; of the first thread
  std::uint32_t num_events_before = 0;                      // in the attempts before
  std::uint32_t num_listed = 0;  // members that may have lists of the attempts before
  ClusterTally tally;  // of the first warp's lanes: hits, and the largest speed; the rest of the first thread

  __device__ __forceinline__ bool leads() const { return threadIdx.x == 0; }
  __device__ __forceinline__ std::uint32_t num() const { return space.num_members; }
  __device__ __forceinline__ Member& operator[](std::uint32_t place) const {
    return place < kHot ? space.hot[place] : memory.members[space.table[place]];
  }

  // Lists the members: slots from `list` on; or with at_ball those of all clusters that expect to hit it.
  // Returns whether there is room for all.
  __device__ __forceinline__ bool start(std::uint32_t name, std::uint32_t list, bool at_ball) {
    cluster = name;
    attempt = counts.round * kMaxAttemptsInRound;
    tally = {};
    num_events_before = 0;
    num_listed = 0;
    if (leads()) {
      num_segments = counts.segments;
      num_neighbour_pairs = counts.neighbour_pairs;
      space.num_members = 0;
      if (!at_ball) add_list(list);
    }
    __syncthreads();
    if (at_ball) {
      add_lists_at_ball();
      __syncthreads();
    }
    return num() <= kCapacity;
  }

  // Puts all members on their start trajectories, and drops what an attempt before has left in the slices.
  template <Boundary kBoundary>
  __device__ __forceinline__ void load(bool has_ball) {
    num_events_before += tally.num_events;
    tally = {};
    ++attempt;
    if (leads()) {
      counts.segments = num_segments;
      counts.neighbour_pairs = num_neighbour_pairs;
      space.other = kInvalidIndex;
      space.event_hash = 0;
      space.ball_joins = 0;
      begin_event();
    }
    for (std::uint32_t k = threadIdx.x; k < num(); k += kExactBlock) {
      (*this)[k] = member_at_start<kBoundary>(step, memory.members[space.table[k]].index, false);
      if (k >= num_listed) forget_list(k);
    }
    mend_lists();
    num_listed = num();
    __syncthreads();
    if (!has_ball && step.has_participant()) keep_hits_on_path<kBoundary>();
  }

  // Members on their start trajectories may hit the ball on its assumed path: half a warp looks for a member.
  template <Boundary kBoundary>
  __device__ __forceinline__ void keep_hits_on_path() {
    for (std::uint32_t base = 0; base < num(); base += kExactBlock / kHalfWarp) {
      const std::uint32_t k = base + threadIdx.x / kHalfWarp;
      Member& member = (*this)[min(k, num() - 1)];
      const bool is_real =
          k < num() && may_hit_participant<kBoundary>(step, step.start_positions()[member.index], member);
      if (!__any_sync(kWholeWarp, is_real)) continue;
      const PathHit hit = hit_on_path_by_half_warp<kBoundary>(step, {member.trajectory, member.id}, is_real);
      if (is_real && threadIdx.x % kHalfWarp == 0) keep_hit(hit, member.event);
    }
  }

  // Makes the lists of the attempts before good for the next one: nothing is noted, and none of the parcels
  // that have come since is outside.
  __device__ __forceinline__ void mend_lists() {
    std::uint32_t* entries = &space.near[0][0];
    for (unsigned e = threadIdx.x; e < min(num_listed, kHot) * BlockSpace::kMaxNear; e += kExactBlock) {
      std::uint32_t entry = entries[e];
      if (entry == kInvalidIndex) continue;
      entry &= ~kNoted;
      for (std::uint32_t k = num_listed; k < num(); ++k) {
        if (memory.members[space.table[k]].index == (entry & kIndexBits)) entry = kInvalidIndex;
      }
      entries[e] = entry;
    }
  }

  // The place of parcel i, which joins the cluster if it is free, without an event. Otherwise kInvalidIndex;
  // space.other is then the cluster that owns it, or this one if there is no room.
  __device__ __forceinline__ std::uint32_t join(std::uint32_t i) {
    if (leads()) space.joined = add(i);
    constexpr unsigned kEntries = kHot * BlockSpace::kMaxNear;
    std::uint32_t* entries = &space.near[0][0];
    for (unsigned e = threadIdx.x; e < kEntries; e += kExactBlock) {
      if ((entries[e] & kIndexBits) == i) entries[e] = kInvalidIndex;
    }
    __syncthreads();
    return space.joined;
  }

  // After a conflict: takes over the members of the other cluster, if that was solved as a pair and little is
  // lost by beginning anew. Returns whether it did; all members must be loaded again then.
  __device__ __forceinline__ bool absorb() {
    constexpr std::uint32_t kMaxEvents = 64, kMaxAttempts = 64;  // of the round; an attempt may have no event
    if (num_events_before + tally.num_events > kMaxEvents || attempt % kMaxAttemptsInRound > kMaxAttempts)
      return false;
    if (leads()) {
      space.joined = kInvalidIndex;
      if (space.other != cluster && num() + 2 <= kCapacity)
        space.joined = absorb_pair(step, space.other, cluster);
      if (space.joined != kInvalidIndex) add_list(space.joined);
      __threadfence();
    }
    __syncthreads();
    return space.joined != kInvalidIndex;
  }

  // Stores the members, as a list that begins with the first one.
  __device__ __forceinline__ void store(std::uint32_t num_stored) const {
    for (std::uint32_t k = threadIdx.x; k < num_stored; k += kExactBlock) {
      Member& member = (*this)[k];
      member.next = k + 1 < num_stored ? space.table[k + 1] : kInvalidIndex;
      if (k < kHot) memory.members[space.table[k]] = member;
    }
  }

  // Stores the members and the outcome for the other blocks. list: that the cluster was started with.
  __device__ __forceinline__ void finish(std::uint32_t list, bool fits, bool solved) {
    const std::uint32_t num_stored = fits ? num() : 0U;
    store(num_stored);
    if (threadIdx.x >= 32) return;
    const float fastest2 = __uint_as_float(warp_max(__float_as_uint(tally.fastest2)));
    if (!leads()) return;
    Cluster& record = cluster_of(step, cluster);
    tally.fastest2 = fastest2;
    tally.event_hash = space.event_hash;
    record.members = fits ? (num_stored > 0 ? space.table[0] : kInvalidIndex) : list;
    record.merged = kInvalidIndex;
    record.solution = solved ? kSolved : kUnsolved;
    record.attempt = attempt;
    record.tally = tally;
    note_solved(step, tally.num_events, num_events_before + tally.num_events);
    if (solved) {
      if (fastest2 > 0.0F) atomicMax(&step.state.fastest_after_bits, __float_as_uint(fastest2));
      return;
    }
    const std::uint32_t other = fits ? space.other : cluster;
    if (other == cluster) {  // too many members, even for a block
      record.needs_block = 1;
      step.state.solve_failed = 1;
    }
    add_conflict(step, counts, cluster, other);
  }

  // Called by the first thread, between two events.
  __device__ __forceinline__ void begin_event() const {
    space.partner = kInvalidIndex;
    space.num_flagged = BlockSpace::kNumChanged;
  }

 private:
  // Takes the members of all clusters of parcels that expect to hit the ball, each by a lane of the first
  // warp.
  __device__ __forceinline__ void add_lists_at_ball() {
    if (threadIdx.x >= 32) return;
    const std::uint32_t num_hits = step.state.num_ball_hits;
    const std::uint32_t name = threadIdx.x < num_hits ? memory.ball_hits[threadIdx.x].cluster : kInvalidIndex;
    const bool is_first = __ffs(__match_any_sync(kWholeWarp, name)) - 1 == static_cast<int>(threadIdx.x);
    if (name == kInvalidIndex || !is_first) return;
    for (std::uint32_t m = memory.list_head[name]; m != kInvalidIndex; m = memory.members[m].next) {
      const std::uint32_t place = atomicAdd(&space.num_members, 1U);
      if (place >= kCapacity) break;  // also if a slot that had no room has closed the list to a ring
      space.table[place] = m;
      memory.owner[memory.members[m].index] = cluster;
    }
    if (name != cluster) cluster_of(step, name).parent = cluster;
    __threadfence();
  }

  // Called by the first thread. num_members may become larger than the capacity by one.
  __device__ __forceinline__ void add_list(std::uint32_t list) {
    for (std::uint32_t m = list; m != kInvalidIndex && space.num_members <= kCapacity;
         m = memory.members[m].next) {
      if (space.num_members < kCapacity) space.table[space.num_members] = m;
      ++space.num_members;
    }
  }

  // Called by the first thread. Loads the parcel while it waits for its claim.
  __device__ __forceinline__ std::uint32_t add(std::uint32_t i) {
    const std::uint32_t place = num();
    if (place == kCapacity) {
      space.other = cluster;
      return kInvalidIndex;
    }
    const Member member = member_without_event(step, i);
    const std::uint32_t owner = claim(step, i, cluster);
    if (owner != kInvalidIndex) {
      space.other = owner;
      return kInvalidIndex;
    }
    const std::uint32_t slot = new_member_slot(step, counts, i);
    space.table[place] = slot;
    memory.members[slot].index = i;
    (*this)[place] = member;
    forget_list(place);
    space.num_members = place + 1;
    return place;
  }

  __device__ __forceinline__ void forget_list(std::uint32_t place) const {
    if (place < kHot) space.num_near[place] = BlockSpace::kNotListed;
  }
};

}  // namespace pf::cuda
