// Method `exact` on the device: a block predicts events of the members of its cluster.
//
// The time goes into instructions that wait for each other. So a team of threads predicts each of the members
// that an event changes or leaves without an event, all of them at once, and each thread compares its team's
// member with one body: a member, a parcel outside, or the ball on a segment of its path. The parcels that a
// member may meet in the window are listed once.
#pragma once

#include "cuda/exact/solve_block_lists.cuh"

namespace pf::cuda {

// All threads of the block call the functions of this class together.
template <Boundary kBoundary, bool kHasBall>
class BlockPredictions : protected BlockLists<kBoundary> {
 protected:
  __device__ __forceinline__ BlockPredictions(const StepContext& step, BlockSpace& space, SliceCounts& counts)
      : Lists(step, space, counts), ball_(step, space) {}

  // Predicts the flagged members. The first two of them, if they are there, have new trajectories: the other
  // members learn of earlier events with these.
  __device__ __forceinline__ void predict_flagged() {
    const unsigned num = space_.num_flagged;
    for (unsigned base = 0; base < num; base += kTeams) predict(base, num);
  }

  using Lists = BlockLists<kBoundary>;
  using Lists::c_, Lists::members_, Lists::space_, Lists::step_;
  using Lists::kNoPlace, Lists::kNumChanged, Lists::kTeam, Lists::kTeams;
  using Lists::rank, Lists::team, Lists::team_barrier;
  using typename Lists::Body, typename Lists::Cursor, typename Lists::NearParcels, typename Lists::Search,
      typename Lists::Subject;

  __device__ __forceinline__ Subject subject_of(unsigned number, unsigned num_flagged) const {
    const std::uint32_t place = number < num_flagged ? space_.flagged[number] : kNoPlace;
    if (place == kNoPlace) return {};
    return this->subject_at(place, number < kNumChanged);
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
    NearParcels near = this->kept_list(it);
    const Search search = this->search_around(it, !near.is_kept);
    Cursor cursor(step_.launch.space, search.box);
    if (!near.is_kept) this->list_near(it, search, cursor, near);
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
        this->list_near(it, search, cursor, near);
        num_done = 0;
      }
      if (first + kTeam >= num_members && num_done >= near.num) break;
    }
    if (!is_whole || near.is_kept) return;
    team_barrier();
    this->keep_list(it, near);
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

  BlockBallMember<kBoundary> ball_;
};

}  // namespace pf::cuda
