// Method `exact` on the device: a cluster's events through a step, solved by a warp. Each lane keeps a member
// in its registers, and candidates are shared among the lanes. backend/exact_cluster_solver.hpp has the same
// for one thread; what is said there holds here. Every formula stands once in the loop: what a step of it
// costs is mostly fetching instructions and waiting for memory.
#pragma once

#include "cuda/exact/clusters.cuh"

namespace pf {

template <Boundary kBoundary>
class WarpSolver {
 public:
  static constexpr unsigned kCapacity = 32;
  static constexpr std::uint32_t kMaxEvents = 20000;

  __device__ __forceinline__ WarpSolver(const ExactLaunch& launch, const ExactConstants& c, ExactState& state,
                                        BlockCounts& counts)
      : launch_(launch),
        a_(launch.arrays),
        c_(c),
        state_(state),
        counts_(counts),
        lane_(threadIdx.x % 32),
        present_(launch.arrays.present[state.current_buffer]) {}

  // Solves the cluster, `list` being its members. All lanes call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    cluster_ = cluster;
    bool fits = false, solved = false;
    do {
      sum_ = {};
      other_ = kInvalidIndex;
      fits = load_members(list);
      if (!fits) other_ = cluster;
      solved = fits && process_events();
    } while (!solved && absorb(list));
    finish(list, fits, solved);
  }

 private:
  static constexpr unsigned kNobody = 32;  // in place of a lane
  static constexpr unsigned kHalf = 16;

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
  __device__ __forceinline__ bool is_member() const { return lane_ < num_; }

  // ---- members

  // Whether they are as few as there are lanes.
  __device__ __forceinline__ bool load_members(std::uint32_t list) {
    num_ = 0;
    for (std::uint32_t m = list; m != kInvalidIndex; m = a_.members[m].next) {
      if (num_ == kCapacity) return false;
      if (lane_ == num_) member_slot_ = m;
      ++num_;
    }
    if (is_member()) it_ = member_at_start(a_, a_.members[member_slot_].index);
    __syncwarp();
    return true;
  }

  // The lane of a parcel that is to take part: it joins if it is nobody's. Else kNobody, and other_ is the
  // cluster whose it is, or this one's own name if there is no room.
  __device__ __forceinline__ unsigned lane_of(std::uint32_t i) {
    const unsigned holding = __ballot_sync(kWholeWarp, is_member() && it_.index == i);
    if (holding != 0) return first_of(holding);
    if (num_ == kCapacity) {
      other_ = cluster_;
      return kNobody;
    }
    const unsigned joining = num_;
    std::uint32_t owner = kInvalidIndex;
    if (lane_ == joining) {
      it_ = member_at_start(a_, i);
      owner = atomicCAS(&a_.owner[i], kInvalidIndex, cluster_);
      __threadfence();  // of two clusters that take a parcel each and then look at the other's, one sees it
      if (owner == kInvalidIndex) {
        std::uint32_t place = atomicAdd(&counts_.members, 1U);
        if (place >= a_.member_capacity) {
          state_.solve_failed = 1;
          place = 0;
        }
        member_slot_ = blockIdx.x * a_.member_capacity + place;
        a_.member_slot[i] = member_slot_;
      }
    }
    owner = from(owner, joining);
    if (owner != kInvalidIndex) {
      other_ = owner;
      return kNobody;
    }
    ++num_;
    return joining;
  }

  // Writes them to memory, as a list that goes on with `rest`.
  __device__ __forceinline__ void write_members(std::uint32_t rest) {
    const std::uint32_t next = __shfl_down_sync(kWholeWarp, member_slot_, 1);
    if (!is_member()) return;
    it_.next = lane_ + 1 < num_ ? next : rest;
    a_.members[member_slot_] = it_;
  }

  // Adds to the list the members of the cluster that this one conflicts with, if that is a pair that
  // solve_pairs solved, as most are: both are solved at once, not in another round.
  __device__ __forceinline__ bool absorb(std::uint32_t& list) {
    std::uint32_t theirs = kInvalidIndex;
    if (lane_ == 0 && other_ != cluster_ && other_ != kBallCluster) {
      ClusterRecord& record = record_of(a_, other_);
      if (atomicCAS(&record.is_solved, kSolvedAsPair, 0U) == kSolvedAsPair) {
        theirs = record.members;
        record.members = kInvalidIndex;
        record.parent = cluster_;
        std::uint32_t m = theirs;
        for (unsigned k = 0; k < 2 && m != kInvalidIndex; ++k, m = a_.members[m].next)
          a_.owner[a_.members[m].index] = cluster_;
      }
    }
    theirs = from(theirs, 0);
    if (theirs == kInvalidIndex) return false;
    write_members(theirs);
    list = from(member_slot_, 0);
    __threadfence();
    __syncwarp();
    return true;
  }

  __device__ __forceinline__ void finish(std::uint32_t list, bool fits, bool solved) {
    if (fits) write_members(kInvalidIndex);
    if (__any_sync(kWholeWarp, sum_.num_hits > 0)) {
      sum_.num_hits = warp_add(sum_.num_hits);
      sum_.ball_x = sum_of_lanes(sum_.ball_x);
      sum_.ball_y = sum_of_lanes(sum_.ball_y);
      sum_.ball_torque = sum_of_lanes(sum_.ball_torque);
    }
    sum_.fastest2 = __uint_as_float(warp_max(__float_as_uint(sum_.fastest2)));
    if (lane_ == 0) {
      ClusterRecord& record = record_of(a_, cluster_);
      record.members = fits ? member_slot_ : list;
      record.merged = kInvalidIndex;
      record.is_solved = solved ? kSolved : 0U;
      record.sum = sum_;
      if (solved) {
        if (sum_.fastest2 > 0.0F) atomicMax(&state_.fastest_after_bits, __float_as_uint(sum_.fastest2));
      } else {
        if (other_ == cluster_) record.wants_block = 1;
        add_conflict(a_, counts_, state_, cluster_, other_);
      }
    }
    __syncwarp();
  }

  static __device__ __forceinline__ long long sum_of_lanes(long long value) {
    for (int offset = 16; offset > 0; offset /= 2) value += __shfl_xor_sync(kWholeWarp, value, offset);
    return value;
  }

  // ---- events

  // The lane of the member with the earliest event of all, or kNobody.
  __device__ __forceinline__ unsigned next_event() const {
    const std::uint32_t tick = is_member() ? it_.event.tick : kNoTick;
    const std::uint32_t min_tick = warp_min(tick);
    if (min_tick == kNoTick) return kNobody;
    const std::uint32_t low = min(it_.id, it_.event.partner_id), high = max(it_.id, it_.event.partner_id);
    const std::uint32_t min_low = warp_min(tick == min_tick ? low : kInvalidIndex);
    const bool among = tick == min_tick && low == min_low;
    const std::uint32_t min_high = warp_min(among ? high : kInvalidIndex);
    return first_of(__ballot_sync(kWholeWarp, among && high == min_high));
  }

  __device__ __forceinline__ bool process_events() {
    while (true) {
      const unsigned who = next_event();
      if (who == kNobody) return true;
      if (sum_.num_events == kMaxEvents) {
        if (lane_ == 0) state_.solve_failed = 1;
        return true;
      }
      const Event event{from(it_.event.tick, who), from(it_.event.partner, who),
                        from(it_.event.partner_id, who)};
      unsigned other = kNobody;
      if (is_parcel(event.partner)) {
        other = lane_of(event.partner);
        if (other == kNobody) return false;
      } else if (event.partner == kBallPartner && c_.plan.ball == BallRole::participant) {
        other_ = load_fresh(&state_.ball_owner);
        return false;
      }
      apply_event(event, who, other);
      unsigned stale = bit(who) | bit(other);
      const unsigned changed = stale;
      while (stale != 0) {
        const unsigned one = first_of(stale);
        stale &= stale - 1;
        const unsigned two = stale != 0 ? first_of(stale) : kNobody;
        stale &= stale - 1;
        stale |= predict(one, two, changed);
      }
    }
  }

  // What the event of member `who`, with another or not, does.
  __device__ __forceinline__ void apply_event(const Event& event, unsigned who, unsigned other) {
    Trajectory now = it_.trajectory;
    const bool takes_part = lane_ == who || lane_ == other;
    if (takes_part) anchor_at<kBoundary>(c_, now, event.tick);
    const std::uint32_t id = from(it_.id, who);
    const std::uint32_t low = min(id, event.partner_id), high = max(id, event.partner_id);
    sum_.event_hash += event_hash(since_reset(state_, event.tick), low, high);
    ++sum_.num_events;
    if (other != kNobody) {
      const bool recent =
          takes_part && c_.plan.contact_duration_ticks != 0 && c_.plan.start + event.tick - it_.last_contact_tick <= c_.plan.contact_duration_ticks;
      const unsigned first_lane = id == low ? who : other;
      Trajectory first = from(now, first_lane), second = from(now, id == low ? other : who);
      collide<kBoundary>(c_, first, second, __any_sync(kWholeWarp, recent) != 0, sum_);
      now = lane_ == first_lane ? first : second;
    } else if (lane_ == who) {
      if (event.partner == kBallPartner) {
        collide_with_ball<kBoundary>(c_, state_.ball.trajectory, event.tick, now, sum_);
      } else {
        apply_edge(c_, event.partner, now);
      }
    }
    if (event.partner == kExit) ++sum_.num_retired;
    if (!takes_part) return;
    set_trajectory(a_, counts_, state_, now, event.tick, it_, sum_);
    if (event.partner != kBallPartner) it_.last_contact_tick = c_.plan.start + event.tick;
  }

  // ---- predictions

  // Of the parcels near a member's, but for the cluster's own, the one that this lane found it to meet first.
  // Each half of the warp searches for its own member, `own` being its lane, or for none.
  __device__ __forceinline__ Event search_others(unsigned own, bool has_changed) {
    const unsigned half_lane = lane_ % kHalf;
    const auto from_half = [](auto value, unsigned lane) {
      return __shfl_sync(kWholeWarp, value, lane, kHalf);
    };
    const Trajectory now = from(it_.trajectory, own % 32);
    const std::uint32_t i = from(it_.index, own % 32);
    const float fastest_mps = from(it_.fastest_mps, own % 32);
    const World& world = launch_.space.world;
    const double in_step = c_.plan.units_per_tick * c_.plan.length;
    const double moved = (static_cast<double>(fastest_mps) + c_.plan.max_speed_mps) * in_step;
    const double distance = c_.run.contact_distance + moved + kRoundingMargin;
    const float within = filter_of(distance);
    const auto contact = static_cast<float>(c_.run.contact_distance);
    const auto per_mps = static_cast<float>(in_step);
    const bool searches = own != kNobody && !is_retired(now.anchor);
    const Vec2i at = searches ? present_[i] : Vec2i{};
    const Vec2i begin = searches ? start_position<kBoundary>(c_, now) : Vec2i{};
    SearchBox box = box_around<kBoundary>(launch_.space, at,
                                          saturated(distance + static_cast<double>(state_.progress.max_displacement)));
    if (!searches) box.num_ranges = 0;
    const unsigned max_ranges = warp_max(box.num_ranges);
    Event best;
    for (unsigned base_range = 0; base_range < max_ranges; base_range += kHalf) {
      const CandidateRange range = range_of(launch_.space, box, base_range + half_lane);
      std::uint32_t end = range.count;  // of the range among all, laid end to end
      for (unsigned offset = 1; offset < kHalf; offset *= 2) {
        const std::uint32_t before = __shfl_up_sync(kWholeWarp, end, offset, kHalf);
        if (half_lane >= offset) end += before;
      }
      const std::uint32_t total = from_half(end, kHalf - 1);
      const std::uint32_t most = warp_max(total);
      const unsigned num_ranges = min(max_ranges - base_range, kHalf);
      for (std::uint32_t base = 0; base < most; base += kHalf) {
        const std::uint32_t k = base + half_lane;
        std::uint32_t j = kInvalidIndex;
        for (unsigned r = 0; r < num_ranges; ++r) {
          const std::uint32_t r_end = from_half(end, r), r_count = from_half(range.count, r);
          const std::uint32_t r_first = from_half(range.first, r);
          if (k < r_end && k + r_count >= r_end) j = r_first + (k + r_count - r_end);
        }
        if (j == kInvalidIndex) continue;
        const std::uint32_t owner = load_fresh(&a_.owner[j]);
        const Vec2i there = present_[j];
        const Vec2f velocity = a_.trajectories.velocity[j];
        const Vec2i offset = separation<kBoundary>(world, at, there);
        const auto x = static_cast<float>(offset.x), y = static_cast<float>(offset.y);
        if (x * x + y * y >= within || owner == cluster_ || j == i) continue;
        const bool foreign = owner != kInvalidIndex;
        if (!foreign &&
            !may_collide(separation<kBoundary>(world, begin, there), velocity - now.velocity, contact, per_mps))
          continue;
        const Trajectory trajectory = trajectory_of(a_, j);
        if (is_retired(trajectory.anchor)) continue;
        if (foreign && has_changed) add_neighbour_pair(a_, counts_, state_, i, j);
        keep_collision(best, collision_tick<kBoundary>(c_, now, trajectory), j, a_.trajectories.id);
      }
    }
    return best;
  }

  // The next events of one or two members, `changed` being those on new lines. Of these also what the others
  // meet: they are told of an earlier event, or are to be predicted anew if theirs was with it; returns who.
  __device__ __forceinline__ unsigned predict(unsigned one, unsigned two, unsigned changed) {
    const bool contacts = c_.run.physics.parcels.contacts;
    const unsigned own = lane_ < 16 ? one : two;
    Event found;
    if (contacts) found = search_others(own, (changed & bit(own)) != 0);
    bool is_stale = false;
    for (unsigned k = 0; k < 2; ++k) {
      const unsigned subject = k == 0 ? one : two;
      if (subject == kNobody) break;
      const Trajectory now = from(it_.trajectory, subject);
      const std::uint32_t i = from(it_.index, subject), id = from(it_.id, subject);
      Event best;
      if (own == subject) best = found;
      if (contacts && is_member() && lane_ != subject && !is_retired(it_.trajectory.anchor)) {
        const std::uint32_t tick = is_retired(now.anchor) ? kNoTick : collision_tick<kBoundary>(c_, now, it_.trajectory);
        keep_earlier(best, {tick, it_.index, it_.id});
        if ((changed & bit(subject)) != 0 && (changed & bit(lane_)) == 0) {
          if (it_.event.partner == i) {
            it_.event = {};
            is_stale = true;
          } else {
            keep_earlier(it_.event, {tick, i, id});
          }
        }
      }
      const std::uint32_t tick = warp_min(best.tick);
      const std::uint32_t partner_id = warp_min(best.tick == tick ? best.partner_id : kNoPartner);
      const bool is_it = best.tick == tick && best.partner_id == partner_id;
      best = {tick, from(best.partner, first_of(__ballot_sync(kWholeWarp, is_it))), partner_id};
      if (lane_ == subject) {
        if (!is_retired(now.anchor)) keep_edge_and_ball(i, now, best);
        it_.event = best;
      }
    }
    return __ballot_sync(kWholeWarp, is_stale);
  }

  __device__ __forceinline__ void keep_edge_and_ball(std::uint32_t i, const Trajectory& now, Event& best) const {
    const Vec2i at = present_[i];
    if (may_reach_edge<kBoundary>(c_, at)) keep_edge_event<kBoundary>(c_, now, best);
    if (c_.plan.ball == BallRole::absent || !is_in<kBoundary>(state_.ball_neighbourhood, c_.run.physics.world, at)) return;
    keep_earlier(best, {ball_collision_tick<kBoundary>(c_, state_.ball.trajectory, now), kBallPartner, kBallPartner});
  }

  const ExactLaunch& launch_;
  const ExactArrays& a_;
  const ExactConstants& c_;
  ExactState& state_;
  BlockCounts& counts_;
  unsigned lane_;
  const Vec2i* present_;
  std::uint32_t cluster_ = 0, other_ = kInvalidIndex;
  unsigned num_ = 0;         // members
  ClusterMember it_;         // this lane's
  std::uint32_t member_slot_ = 0;  // among the members in memory
  EventSums sum_;            // the same in all lanes, but for hits of the ball and the fastest
};

}  // namespace pf
