// Method `exact` on the device: a block predicts events of the members of its cluster.
//
// The time goes into instructions that wait for each other. So a team of threads predicts each of the members
// that an event changes or leaves without an event, all of them at once, and each thread compares its team's
// member with one body: a member, a parcel outside, or the ball on a segment of its path. The parcels that a
// member may meet in the window are listed once.
#pragma once

#include "cuda/exact/solve_block_ball.cuh"

namespace pf::cuda {

// All threads of the block call the functions of this class together.
template <Boundary kBoundary, bool kHasBall>
class BlockPredictions {
 protected:
  __device__ __forceinline__ BlockPredictions(const StepContext& step, BlockSpace& space, BlockCounts& counts)
      : step_(step),
        c_(step.c),
        state_(step.state),
        space_(space),
        members_{step, step.memory, counts, space},
        ball_(step, space),
        window_begin_(static_cast<std::int32_t>(step.state.window_begin)) {}

  // Predicts the flagged members. The first two of them, if they are there, have new trajectories: the other
  // members learn of earlier events with these.
  __device__ __forceinline__ void predict_flagged() {
    const unsigned num = space_.num_flagged;
    for (unsigned base = 0; base < num; base += kTeams) predict(base, num);
  }

  // Lists what is near the members that have no list yet, each by a team: all of them at once takes no longer
  // than each of them before its first event.
  __device__ __forceinline__ void list_members() {
    if (!c_.run.physics.parcels.contacts) return;
    const unsigned num = min(members_.num(), BlockSpace::kHot);
    for (unsigned place = team(); place < num; place += kTeams) {
      if (space_.num_near[place] != BlockSpace::kNotListed) continue;
      const Subject it = subject_at(place, false);
      if (!it.is_there) continue;
      NearParcels near{space_.piece[team()], 0, false};
      const Search search = search_around(it, true);
      Cursor cursor(step_.launch.space, search.box);
      list_near(it, search, cursor, near);
      if (!cursor.has_more()) keep_list(it, near);
    }
  }

  static constexpr std::uint16_t kNoPlace = 0xFFFF;
  static constexpr unsigned kNumChanged = BlockSpace::kNumChanged;

 private:
  static constexpr unsigned kTeam = BlockSpace::kTeam, kTeams = BlockSpace::kTeams;
  using Cursor = CandidateCursor<kTeam, 1>;

  // The member that a team predicts.
  struct Subject {
    std::uint32_t place = kNoPlace;  // kNoPlace: none
    std::uint32_t index = 0, id = 0;
    bool is_there = false;     // there is one, and it has not retired
    bool has_changed = false;  // it is on a new trajectory
    bool just_hit = false;     // by the ball
    Trajectory now{};
    std::uint32_t next_generation = 0;
    Vec2i here{};  // position at the step's start
  };

  // What a thread compares the subject with. kNoPartner: nothing.
  struct Body {
    std::uint32_t partner = kNoPartner, id = kNoPartner;  // as in Event
    std::uint32_t next_generation = 0;
    Trajectory trajectory{};
  };

  // Parcels outside that are near a subject: a part of them, or all.
  struct NearParcels {
    std::uint32_t* entries;
    unsigned num;
    bool is_kept;  // in the member's list
  };

  // The search for these.
  struct Search {
    Vec2i at_begin;  // the subject's position at the window's start
    float radius2;   // of the circle around it
    SearchBox box;
  };

  static __device__ __forceinline__ unsigned team() { return threadIdx.x / kTeam; }
  static __device__ __forceinline__ unsigned rank() { return threadIdx.x % kTeam; }
  static __device__ __forceinline__ void team_barrier() { __barrier_sync_count(1 + team(), kTeam); }

  __device__ __forceinline__ Subject subject_of(unsigned number, unsigned num_flagged) const {
    const std::uint32_t place = number < num_flagged ? space_.flagged[number] : kNoPlace;
    if (place == kNoPlace) return {};
    return subject_at(place, number < kNumChanged);
  }

  __device__ __forceinline__ Subject subject_at(std::uint32_t place, bool has_changed) const {
    const Member& member = members_[place];
    return {place,
            member.index,
            member.id,
            !is_retired(member.trajectory.anchor),
            has_changed,
            member.has_changed == kHitBall,
            member.trajectory,
            member.next_generation,
            step_.start_positions()[member.index]};
  }

  // Each team predicts one of the flagged members from `base` on.
  __device__ __forceinline__ void predict(unsigned base, unsigned num_flagged) {
    const Subject it = subject_of(base + team(), num_flagged);
    Event best, at_ball;
    bool knows_hit = !it.just_hit || !step_.has_participant();
    const bool finds_ball_event = kHasBall && base == 0;
    if constexpr (kHasBall) {
      if (base == 0) at_ball = ball_.first_hit(members_);
    }
    if (it.is_there) {
      if constexpr (!kHasBall) look_along_path(it, at_ball, knows_hit);
      if (rank() == kTeam / 2)
        keep_edge<kBoundary>(step_, it.here, {it.now, it.id, it.next_generation, it.just_hit}, best);
    }
    if (c_.run.physics.parcels.contacts) compare_with_parcels(it, base == 0, best);
    keep_first(it, best, at_ball, knows_hit && !kHasBall, finds_ball_event);
  }

  // Stores the first event of a team's threads as the subject's.
  __device__ __forceinline__ void keep_first(const Subject& it, const Event& event,
                                             const Event& event_at_ball, bool knows_hit,
                                             bool finds_ball_event) {
    const unsigned warp = threadIdx.x / 32;
    const Event best = first_in_warp(event), at_ball = first_in_warp(event_at_ball);
    const bool knows = __any_sync(kWholeWarp, knows_hit);
    if (threadIdx.x % 32 == 0) {
      space_.best[warp] = best;
      space_.at_ball[warp] = at_ball;
      space_.knows_hit[warp] = knows;
    }
    __syncthreads();
    if (it.place != kNoPlace && rank() == 0) {
      Event first = best;
      keep_earlier(first, space_.best[warp + 1]);
      if (knows || space_.knows_hit[warp + 1] != 0) {
        keep_earlier(first, at_ball);
        keep_earlier(first, space_.at_ball[warp + 1]);
      }
      members_[it.place].event = first;
    }
    if (members_.leads()) members_.begin_event();  // all know how many are flagged
    if (finds_ball_event && threadIdx.x == kExactBlock - 1) ball_.keep_event(space_.at_ball);
    __syncthreads();
  }

  static __device__ __forceinline__ Event first_in_warp(const Event& event) {
    const OrderedEvent first =
        first_of_warp({event.tick, event.generation, event.partner_id, event.partner_id, event.partner});
    if (first.tick == kNoTick) return {};
    return {first.tick, first.place, first.low_id, first.generation};
  }

  // ---- the ball

  // The subject's hit on the ball's path: each thread looks at a segment. The first segment with a hit has
  // the earliest. See hit_on_path for knows_hit.
  __device__ __forceinline__ void look_along_path(const Subject& it, Event& best, bool& knows_hit) const {
    if (c_.plan.ball == BallRole::absent || !step_.template is_near_ball<kBoundary>(it.here)) return;
    const BallPath path = assumed_path(step_);
    const ParcelNearBall parcel{it.now, it.id, it.next_generation, it.just_hit};
    for (unsigned s = kTeam - 1 - rank(); s < path.num; s += kTeam) {
      keep_hit(hit_on_segment<kBoundary>(step_, path, s, parcel), best);
      if (s > 0 && begins_with_hit_of(step_, path.segments[s], parcel)) knows_hit = true;
    }
  }

  // ---- parcels

  // The subject's first event with a member or a parcel outside. are_first: the teams predict the members of
  // the event, and others.
  __device__ __forceinline__ void compare_with_parcels(const Subject& it, bool are_first, Event& best) {
    const unsigned num_members = members_.num();
    NearParcels near = kept_list(it);
    const Search search = search_around(it, !near.is_kept);
    Cursor cursor(step_.launch.space, search.box);
    if (!near.is_kept) list_near(it, search, cursor, near);
    const bool is_whole = !cursor.has_more();
    unsigned num_done = 0;  // of the listed ones
    for (unsigned first = 0;; first += kTeam) {
      const unsigned num_here = first < num_members ? min(num_members - first, kTeam) : 0U;
      // The threads without a member take a parcel outside.
      const unsigned listed = num_done + rank() - num_here;
      Body body;
      if (rank() < num_here) {
        body = member_to_compare(it, first + rank());
      } else if (listed < near.num) {
        body = parcel_to_compare(it, near.entries[listed]);
      }
      num_done += kTeam - num_here;
      const Event event = compare(it, body);
      keep_earlier(best, event);
      if (are_first && num_here > 0) tell(event, first, num_here, num_members);
      if (num_done >= near.num && cursor.has_more()) {
        team_barrier();
        list_near(it, search, cursor, near);
        num_done = 0;
      }
      if (first + kTeam >= num_members && num_done >= near.num) break;
    }
    if (!is_whole || near.is_kept) return;
    team_barrier();
    keep_list(it, near);
  }

  __device__ __forceinline__ Body member_to_compare(const Subject& it, std::uint32_t place) const {
    if (place == it.place) return {};
    const Member& member = members_[place];
    return {member.index, member.id, member.next_generation, member.trajectory};
  }

  // A parcel outside: a free one on its start trajectory, one of another cluster on any.
  __device__ __forceinline__ Body parcel_to_compare(const Subject& it, std::uint32_t& entry) const {
    if (entry == kInvalidIndex) return {};
    const std::uint32_t j = entry & kIndexBits;
    if ((entry & kForeign) != 0 && (entry & kNoted) == 0 && it.has_changed) {
      add_neighbour_pair(step_, members_.counts, it.index, j);
      entry |= kNoted;
    }
    return {j, step_.id(j), 0, step_.start_trajectory(j)};
  }

  __device__ __forceinline__ Event compare(const Subject& it, const Body& other) const {
    if (!it.is_there || other.partner == kNoPartner || is_retired(other.trajectory.anchor)) return {};
    const std::uint32_t tick = collision_tick<kBoundary>(c_, it.now, other.trajectory);
    return {tick, other.partner, other.id,
            max(generation_of(step_, tick, it.now, it.next_generation),
                generation_of(step_, tick, other.trajectory, other.next_generation))};
  }

  // The members from `first` on learn of collisions with the members of the event, which the first teams have
  // just compared them with. event: of this thread.
  __device__ __forceinline__ void tell(const Event& event, unsigned first, unsigned num_here,
                                       unsigned num_members) {
    if (team() < kNumChanged) space_.told[team()][rank()] = {event.tick, event.generation};
    __syncthreads();
    if (threadIdx.x < num_here) {
      for (unsigned k = 0; k < kNumChanged; ++k) {
        const ToldEvent told = space_.told[k][threadIdx.x];
        if (told.tick == kNoTick) continue;
        const Member& subject = members_[space_.flagged[k]];
        keep_earlier(members_[first + threadIdx.x].event,
                     {told.tick, subject.index, subject.id, told.generation});
      }
    }
    if (first + kTeam < num_members) __syncthreads();
  }

  // ---- lists of parcels outside

  // The list that the subject has.
  __device__ __forceinline__ NearParcels kept_list(const Subject& it) const {
    if (!it.is_there) return {nullptr, 0, true};
    if (it.place < BlockSpace::kHot && space_.num_near[it.place] != BlockSpace::kNotListed)
      return {space_.near[it.place], space_.num_near[it.place], true};
    return {space_.piece[team()], 0, false};
  }

  // The search for the parcels that the subject may meet in the window, however fast it becomes: a window in
  // which the bound on speeds is too low counts for nothing. They lie in a circle around its position at the
  // window's start.
  __device__ __forceinline__ Search search_around(const Subject& it, bool is_wanted) const {
    Search search{};
    if (!is_wanted) return search;
    const double closing_mps = 2.0 * c_.plan.max_speed_mps;
    const double before = closing_mps * c_.plan.units_per_tick * window_begin_;
    const double radius = search_radius(c_, closing_mps);
    search.box = box_around<kBoundary>(step_.launch.space, it.here, step_.search_reach(radius));
    search.at_begin = position_at<kBoundary>(c_, step_.start_trajectory(it.index), window_begin_);
    search.radius2 = static_cast<float>((radius - before) * (radius - before));
    return search;
  }

  // Lists the next parcels of the search: at least one team's worth of candidates, and as many as there are
  // room for.
  __device__ __forceinline__ void list_near(const Subject& it, const Search& search, Cursor& cursor,
                                            NearParcels& near) {
    std::uint32_t& num = space_.num_in_piece[team()];
    if (rank() == 0) num = 0;
    team_barrier();
    near.num = 0;
    while (cursor.has_more() && near.num + kTeam <= BlockSpace::kMaxPiece) {
      std::uint32_t candidate[1];
      cursor.next(candidate);
      if (candidate[0] != kInvalidIndex) {
        const std::uint32_t j = candidate[0], owner = step_.owner_of(j);
        const Trajectory there = step_.start_trajectory(j);
        const Vec2i offset = separation<kBoundary>(step_.world(), search.at_begin,
                                                   position_at<kBoundary>(c_, there, window_begin_));
        const auto x = static_cast<float>(offset.x), y = static_cast<float>(offset.y);
        if (owner != members_.cluster && !is_retired(there.anchor) && x * x + y * y < search.radius2)
          near.entries[atomicAdd(&num, 1U)] = j | (owner != kInvalidIndex ? kForeign : 0U);
      }
      team_barrier();
      near.num = num;
      team_barrier();
    }
  }

  // Makes the parcels found the member's list.
  __device__ __forceinline__ void keep_list(const Subject& it, const NearParcels& near) {
    if (it.place >= BlockSpace::kHot || near.num > BlockSpace::kMaxNear) return;
    if (rank() < near.num) space_.near[it.place][rank()] = near.entries[rank()];
    if (rank() == 0) space_.num_near[it.place] = static_cast<std::uint16_t>(near.num);
  }

 protected:
  const StepContext& step_;
  const ExactConstants& c_;
  ExactState& state_;
  BlockSpace& space_;
  BlockMembers members_;
  BlockBallMember<kBoundary> ball_;

 private:
  std::int32_t window_begin_;
};

}  // namespace pf::cuda
