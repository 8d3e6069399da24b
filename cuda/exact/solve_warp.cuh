// Method `exact` on the device: a warp solves a cluster, as the CPU's ClusterSolver does with one thread.
// Each lane keeps a member in its registers, and lanes share the candidates of searches. Every formula stands
// once in the loop over events: most of the time goes into fetching instructions and waiting for memory.
#pragma once

#include "cuda/exact/solve_common.cuh"

namespace pf::cuda {

// Shared memory of a block's warps.
struct WarpSpace {
  static constexpr unsigned kHalf = 16;
  std::uint32_t near[kExactBlock / kHalf][kHalf];  // parcels that a half of a warp has found
};

template <Boundary kBoundary>
class WarpSolver {
 public:
  static constexpr unsigned kCapacity = 32;  // members

  __device__ __forceinline__ WarpSolver(const StepContext& step, WarpSpace& space, BlockCounts& counts)
      : step_(step),
        memory_(step.memory),
        c_(step.c),
        counts_(counts),
        near_(space.near[threadIdx.x / WarpSpace::kHalf]),
        lane_(threadIdx.x % 32),
        positions_(step.start_positions()),
        max_events_(step.state.max_events) {}

  // Solves the cluster. list: slot of its first member. All lanes call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    cluster_ = cluster;
    attempt_ = counts_.round * kMaxAttemptsInRound;
    bool fits = false, solved = false;
    do {
      tally_ = {};
      ++attempt_;
      other_ = kInvalidIndex;
      fits = load_members(list);
      if (!fits) other_ = cluster;
      solved = fits && process_events();
    } while (!solved && absorb(list));
    finish(list, fits, solved);
  }

 private:
  static constexpr unsigned kNoLane = 32;
  static constexpr unsigned kAhead = 2;

  struct Candidate {
    std::uint32_t index, owner;
    Vec2i position;  // at the step's start
    Vec2f velocity;
  };

  static __device__ __forceinline__ unsigned first_of(unsigned lanes) { return __ffs(lanes) - 1; }
  static __device__ __forceinline__ unsigned bit(unsigned lane) { return lane < 32 ? 1U << lane : 0U; }
  template <class T>
  static __device__ __forceinline__ T from(T value, unsigned lane) {
    return __shfl_sync(kWholeWarp, value, lane);
  }
  static __device__ __forceinline__ Trajectory from(const Trajectory& trajectory, unsigned lane) {
    return {{from(trajectory.anchor.x, lane), from(trajectory.anchor.y, lane)},
            {from(trajectory.velocity.x, lane), from(trajectory.velocity.y, lane)},
            from(trajectory.tick, lane)};
  }
  static __device__ __forceinline__ long long sum_of_lanes(long long value) {
    for (int offset = 16; offset > 0; offset /= 2) value += __shfl_xor_sync(kWholeWarp, value, offset);
    return value;
  }
  __device__ __forceinline__ bool is_member() const { return lane_ < num_; }

  // ---- members

  // Returns whether each member gets a lane.
  __device__ __forceinline__ bool load_members(std::uint32_t list) {
    num_ = 0;
    for (std::uint32_t m = list; m != kInvalidIndex; m = memory_.members[m].next) {
      if (num_ == kCapacity) return false;
      if (lane_ == num_) slot_ = m;
      ++num_;
    }
    if (is_member()) {
      it_ = member_at_start<kBoundary>(step_, memory_.members[slot_].index);
      here_ = positions_[it_.index];
    }
    __syncwarp();
    return true;
  }

  // The lane of parcel i, which joins the cluster if it is free. Otherwise kNoLane; other_ is then the
  // cluster that owns it, or this one if there is no lane left.
  __device__ __forceinline__ unsigned lane_of(std::uint32_t i) {
    const unsigned holding = __ballot_sync(kWholeWarp, is_member() && it_.index == i);
    if (holding != 0) return first_of(holding);
    if (num_ == kCapacity) {
      other_ = cluster_;
      return kNoLane;
    }
    const unsigned joining = num_;
    std::uint32_t owner = kInvalidIndex;
    if (lane_ == joining) {
      it_ = member_away_from_ball(step_, i);
      here_ = positions_[i];
      owner = claim(step_, i, cluster_);
      if (owner == kInvalidIndex) slot_ = new_member_slot(step_, counts_, i);
    }
    owner = from(owner, joining);
    if (owner != kInvalidIndex) {
      other_ = owner;
      return kNoLane;
    }
    ++num_;
    if (__any_sync(kWholeWarp, lane_ == joining && may_hit_participant<kBoundary>(step_, here_, it_))) {
      const ParcelNearBall joined{from(it_.trajectory, joining), from(it_.id, joining)};
      const PathHit hit = hit_on_path_by_half_warp<kBoundary>(step_, joined, true);
      if (lane_ == joining) keep_hit(hit, it_.event);
    }
    return joining;
  }

  // Writes the members to memory as a list that continues with `rest`.
  __device__ __forceinline__ void write_members(std::uint32_t rest) {
    const std::uint32_t next = __shfl_down_sync(kWholeWarp, slot_, 1);
    if (!is_member()) return;
    it_.next = lane_ + 1 < num_ ? next : rest;
    memory_.members[slot_] = it_;
  }

  // Takes over the members of the cluster that this one conflicts with, if that was solved as a pair, as most
  // clusters are: then both are solved at once, without another round. Returns whether it did.
  __device__ __forceinline__ bool absorb(std::uint32_t& list) {
    std::uint32_t absorbed = kInvalidIndex;
    if (lane_ == 0 && other_ != cluster_) {
      Cluster& other = cluster_of(step_, other_);
      if (atomicCAS(&other.solution, kSolvedAsPair, kUnsolved) == kSolvedAsPair) {
        absorbed = other.members;
        other.members = kInvalidIndex;
        other.parent = cluster_;
        std::uint32_t m = absorbed;
        for (unsigned k = 0; k < 2 && m != kInvalidIndex; ++k, m = memory_.members[m].next)
          memory_.owner[memory_.members[m].index] = cluster_;
      }
    }
    absorbed = from(absorbed, 0);
    if (absorbed == kInvalidIndex) return false;
    write_members(absorbed);
    list = from(slot_, 0);
    __threadfence();
    __syncwarp();
    return true;
  }

  __device__ __forceinline__ void finish(std::uint32_t list, bool fits, bool solved) {
    if (fits) write_members(kInvalidIndex);
    if (__any_sync(kWholeWarp, tally_.num_hits > 0)) {
      tally_.num_hits = warp_add(tally_.num_hits);
      tally_.ball_x = sum_of_lanes(tally_.ball_x);
      tally_.ball_y = sum_of_lanes(tally_.ball_y);
      tally_.ball_torque = sum_of_lanes(tally_.ball_torque);
    }
    tally_.fastest2 = __uint_as_float(warp_max(__float_as_uint(tally_.fastest2)));
    if (lane_ == 0) {
      Cluster& cluster = cluster_of(step_, cluster_);
      cluster.members = fits ? slot_ : list;
      cluster.merged = kInvalidIndex;
      cluster.solution = solved ? kSolved : kUnsolved;
      cluster.attempt = attempt_;
      cluster.tally = tally_;
      note_solved(step_, tally_.num_events);
      if (solved) {
        if (tally_.fastest2 > 0.0F)
          atomicMax(&step_.state.fastest_after_bits, __float_as_uint(tally_.fastest2));
      } else {
        if (other_ == cluster_) cluster.needs_block = 1;
        add_conflict(step_, counts_, cluster_, other_);
      }
    }
    __syncwarp();
  }

  // ---- events

  // Lane of the member whose event comes first, or kNoLane.
  __device__ __forceinline__ unsigned next_event() const {
    const std::uint32_t tick = is_member() ? it_.event.tick : kNoTick;
    const std::uint32_t min_tick = warp_min(tick);
    if (min_tick == kNoTick) return kNoLane;
    const std::uint32_t low = min(it_.id, it_.event.partner_id), high = max(it_.id, it_.event.partner_id);
    bool among = tick == min_tick;
    const unsigned first = first_of(__ballot_sync(kWholeWarp, among));
    const std::uint32_t first_low = from(low, first), first_high = from(high, first);
    const bool differs = among && (low != first_low || high != first_high);
    if (!__any_sync(kWholeWarp, differs)) return first;
    const auto keep_lowest = [&](std::uint32_t value) {
      const std::uint32_t lowest = warp_min(among ? value : kInvalidIndex);
      among = among && value == lowest;
    };
    keep_lowest(it_.event.generation);
    keep_lowest(low);
    keep_lowest(high);
    return first_of(__ballot_sync(kWholeWarp, among));
  }

  // Applies events in their order up to the step's end. Returns false if another cluster owns a partner.
  __device__ __forceinline__ bool process_events() {
    while (true) {
      const unsigned own = next_event();
      if (own == kNoLane) return true;
      if (tally_.num_events == max_events_) {
        if (lane_ == own) stop_at(step_, it_.event.tick);
        return true;
      }
      const Event event{from(it_.event.tick, own), from(it_.event.partner, own),
                        from(it_.event.partner_id, own), from(it_.event.generation, own)};
      unsigned other = kNoLane;
      if (is_parcel(event.partner)) {
        other = lane_of(event.partner);
        if (other == kNoLane) return false;
      }
      apply_event(event, own, other);
      unsigned stale = bit(own) | bit(other);
      const unsigned changed = stale;
      while (stale != 0) {
        const unsigned one = first_of(stale);
        stale &= stale - 1;
        const unsigned two = stale != 0 ? first_of(stale) : kNoLane;
        stale &= stale - 1;
        stale |= predict(one, two, changed);
      }
    }
  }

  // Applies the event of lane `own`; other: the partner's lane, or kNoLane.
  __device__ __forceinline__ void apply_event(const Event& event, unsigned own, unsigned other) {
    Trajectory now = it_.trajectory;
    const bool takes_part = lane_ == own || lane_ == other;
    if (takes_part) anchor_at<kBoundary>(c_, now, event.tick);
    const std::uint32_t id = from(it_.id, own);
    const std::uint32_t low = min(id, event.partner_id), high = max(id, event.partner_id);
    tally_.event_hash += event_hash(step_.since_reset(event.tick), low, high);
    ++tally_.num_events;
    if (other != kNoLane) {
      const bool recent = takes_part && is_in_contact(c_.plan, event.tick, it_.last_contact_tick);
      const unsigned first_lane = id == low ? own : other;
      Trajectory first = from(now, first_lane), second = from(now, id == low ? other : own);
      collide<kBoundary>(c_, first, second, __any_sync(kWholeWarp, recent) != 0, tally_);
      now = lane_ == first_lane ? first : second;
    } else if (lane_ == own) {
      if (event.partner == kBallPartner) {
        hit_ball<kBoundary>(step_, it_,
                            {event.tick, it_.id, cluster_, attempt_, it_.trajectory, it_.next_generation},
                            now, tally_);
      } else {
        apply_edge(c_, event.partner, now);
      }
    }
    if (event.partner == kExit) tally_.retired();
    if (!takes_part) return;
    set_trajectory(step_, counts_, now, event, it_, tally_);
    if (event.partner != kBallPartner)
      it_.last_contact_tick = c_.plan.start + event.tick;
    else
      it_.has_changed = kHitBall;
  }

  // ---- predictions

  // The earliest collision that this lane finds of a member with parcels outside the cluster. Each half of
  // the warp searches for its own member: `own` is the member's lane, or kNoLane.
  __device__ __forceinline__ Event search_others(unsigned own, bool has_changed) {
    const Trajectory now = from(it_.trajectory, own % 32);
    const std::uint32_t i = from(it_.index, own % 32);
    const Vec2i here{from(here_.x, own % 32), from(here_.y, own % 32)};
    const float fastest_mps = from(it_.fastest_mps, own % 32);
    const std::uint32_t next_generation = from(it_.next_generation, own % 32);
    const World& world = step_.launch.space.world;
    const bool searches = own != kNoLane && !is_retired(now.anchor);
    const auto near = MemberSearch::around<kBoundary>(step_, here, now, fastest_mps);
    SearchBox box = box_around<kBoundary>(step_.launch.space, here, near.reach);
    if (!searches) box.num_ranges = 0;
    Event best;
    unsigned num_near = 0;  // of this half
    const auto predict_listed = [&] {
      __syncwarp();
      if (lane_ % WarpSpace::kHalf < num_near) {
        const std::uint32_t j = near_[lane_ % WarpSpace::kHalf];
        const std::uint32_t id = load_early(&memory_.trajectories.id[j]);
        const bool is_owned = step_.owner_of(j) != kInvalidIndex;
        const Trajectory other = step_.start_trajectory(j);
        if (!is_retired(other.anchor)) {
          if (is_owned && has_changed) add_neighbour_pair(step_, counts_, i, j);
          const std::uint32_t tick = collision_tick<kBoundary>(c_, now, other);
          keep_earlier(best, {tick, j, id, generation_of(step_, tick, now, next_generation)});
        }
      }
      num_near = 0;
      __syncwarp();
    };
    const auto load = [&](std::uint32_t j) -> Candidate {
      if (j == kInvalidIndex) return {j, 0, {}, {}};
      return {j, step_.owner_of(j), positions_[j], memory_.trajectories.velocity[j]};
    };
    visit_box_by_half_warp<kAhead>(step_.launch.space, box, load, [&](const Candidate& it) {
      const bool is_other = it.index != kInvalidIndex && it.index != i && it.owner != cluster_;
      const bool is_near =
          is_other && near.template holds<kBoundary>(world, it.position) &&
          (it.owner != kInvalidIndex || near.template may_hit<kBoundary>(step_, it.position, it.velocity));
      const unsigned lanes = __ballot_sync(kWholeWarp, is_near) >> (lane_ & WarpSpace::kHalf) & 0xFFFFU;
      const unsigned num = __popc(lanes);
      if (__any_sync(kWholeWarp, num_near + num > WarpSpace::kHalf)) predict_listed();
      if (is_near) near_[num_near + __popc(lanes & (bit(lane_ % WarpSpace::kHalf) - 1))] = it.index;
      num_near += num;
    });
    predict_listed();
    return best;
  }

  // The same for the edge and the ball, in all lanes of the half.
  __device__ __forceinline__ void keep_edge_and_ball_of(unsigned own, Event& best) {
    const Vec2i here{from(here_.x, own % 32), from(here_.y, own % 32)};
    const ParcelNearBall subject{from(it_.trajectory, own % 32), from(it_.id, own % 32),
                                 from(it_.next_generation, own % 32),
                                 from(it_.has_changed, own % 32) == kHitBall};
    const bool is_there = own != kNoLane && !is_retired(subject.trajectory.anchor);
    if (is_there) keep_edge<kBoundary>(step_, here, subject, best);
    const bool may_hit = is_there && c_.plan.ball != BallRole::absent && step_.is_near_ball<kBoundary>(here);
    if (__any_sync(kWholeWarp, may_hit))
      keep_hit(hit_on_path_by_half_warp<kBoundary>(step_, subject, may_hit), best);
  }

  // Predicts the next events of one or two members. changed: lanes of members with new trajectories. The
  // other members learn of earlier events with these; those whose partner left the trajectory of their event
  // must be predicted next. Returns their lanes.
  __device__ __forceinline__ unsigned predict(unsigned one, unsigned two, unsigned changed) {
    const bool contacts = c_.run.physics.parcels.contacts;
    const unsigned own = lane_ < 16 ? one : two;
    Event found;
    if (contacts) found = search_others(own, (changed & bit(own)) != 0);
    keep_edge_and_ball_of(own, found);
    bool is_stale = false;
    for (unsigned k = 0; k < 2; ++k) {
      const unsigned subject = k == 0 ? one : two;
      if (subject == kNoLane) break;
      const Trajectory now = from(it_.trajectory, subject);
      const std::uint32_t i = from(it_.index, subject), id = from(it_.id, subject);
      const std::uint32_t next_generation = from(it_.next_generation, subject);
      Event best;
      if (own == subject) best = found;
      if (contacts && is_member() && lane_ != subject && !is_retired(it_.trajectory.anchor)) {
        const std::uint32_t tick =
            is_retired(now.anchor) ? kNoTick : collision_tick<kBoundary>(c_, now, it_.trajectory);
        const std::uint32_t generation = max(generation_of(step_, tick, now, next_generation),
                                             generation_of(step_, tick, it_.trajectory, it_.next_generation));
        keep_earlier(best, {tick, it_.index, it_.id, generation});
        if ((changed & bit(subject)) != 0 && (changed & bit(lane_)) == 0) {
          is_stale |= it_.event.partner == i;
          update_event({tick, i, id, generation});
        }
      }
      best = earliest_of_lanes(best);
      if (lane_ == subject) {
        it_.event = best;
      }
    }
    return __ballot_sync(kWholeWarp, is_stale);
  }

  // After a member got a new trajectory; collision: of this lane's member with it.
  __device__ __forceinline__ void update_event(const Event& collision) {
    if (it_.event.partner == collision.partner) {
      it_.event = {};
    } else {
      keep_earlier(it_.event, collision);
    }
  }

  static __device__ __forceinline__ Event earliest_of_lanes(const Event& best) {
    const std::uint32_t tick = warp_min(best.tick);
    if (tick == kNoTick) return {};
    bool among = best.tick == tick;
    if (__popc(__ballot_sync(kWholeWarp, among)) > 1) {
      const std::uint32_t generation = warp_min(among ? best.generation : kNoTick);
      among = among && best.generation == generation;
      const std::uint32_t partner_id = warp_min(among ? best.partner_id : kNoPartner);
      among = among && best.partner_id == partner_id;
    }
    const unsigned lane = first_of(__ballot_sync(kWholeWarp, among));
    return {tick, from(best.partner, lane), from(best.partner_id, lane), from(best.generation, lane)};
  }

  const StepContext& step_;
  const StepMemory& memory_;
  const ExactConstants& c_;
  BlockCounts& counts_;
  std::uint32_t* near_;  // of this half
  unsigned lane_;
  const Vec2i* positions_;  // at the step's start
  std::uint32_t max_events_;
  std::uint32_t cluster_ = 0;
  std::uint32_t attempt_ = 0;
  std::uint32_t other_ = kInvalidIndex;  // cluster that stopped this one
  unsigned num_ = 0;                     // members
  Member it_;                            // this lane's member
  Vec2i here_{};                         // its position at the step's start
  std::uint32_t slot_ = 0;               // its slot
  ClusterTally tally_;                   // equal in all lanes, except hits of the ball and the largest speed
};

}  // namespace pf::cuda
