// Method `exact` on the device: a warp predicts events of the members of its cluster.
//
// The time goes into instructions that wait for each other. So the two members of an event are predicted at
// once, one by each half of the warp, and each lane compares its half's member with one body: a member, a
// parcel outside, or the ball.
#pragma once

#include "cuda/exact/solve_warp_members.cuh"
#include "cuda/half_warp.cuh"

namespace pf::cuda {

// All lanes call the functions of this class together.
class WarpPredictions : protected WarpMembers {
 protected:
  __device__ __forceinline__ WarpPredictions(const StepContext& step, WarpSpace& space, SliceCounts& counts)
      : WarpMembers(step, space, counts), near_(space.near[threadIdx.x / kHalfWarp]) {}

  // Predicts the next events of one or two members. changed: lanes of members with new trajectories. The
  // other members learn of earlier events with these; those whose partner left the trajectory of their event
  // must be predicted next. Returns their lanes.
  template <Boundary kBoundary>
  __device__ __forceinline__ unsigned predict(unsigned one, unsigned two, unsigned changed) {
    const Subject subject = subject_of(lane_ < kHalfWarp ? one : two, changed);
    const unsigned num_members = c_.run.physics.parcels.contacts ? num_ : 0U;
    const auto near = MemberSearch::around<kBoundary>(step_, subject.member.here, subject.trajectory(),
                                                      subject.member.it.fastest_mps);
    SearchBox box = box_around<kBoundary>(step_.launch.space, subject.member.here, near.reach);
    if (!subject.is_there || num_members == 0) box.num_ranges = 0;
    CandidateCursor<kHalfWarp, kAhead> cursor(step_.launch.space, box);
    bool is_at_ball = subject.is_there && c_.plan.ball != BallRole::absent &&
                      step_.is_near_ball<kBoundary>(subject.member.here);
    bool may_meet_ball = false, is_stale = false;
    unsigned num_near = 0;  // listed ones of this half
    Event best;
    if (subject.is_there && half_lane() == 0)
      keep_edge<kBoundary>(step_, subject.member.here, subject.body(), best);
    for (unsigned first_member = 0;; first_member += kHalfWarp) {
      while (cursor.has_more() &&
             !__any_sync(kWholeWarp, num_near + kAhead * kHalfWarp > WarpSpace::kMaxNear))
        list_near<kBoundary>(near, subject, cursor, num_near);
      __syncwarp();
      const unsigned member = first_member + half_lane();
      const bool with_member = member < num_members && member != subject.lane;
      // The lanes without a member take what else is to be compared.
      const unsigned free = in_half_warp(!with_member), num_free = __popc(free);
      const unsigned rank = __popc(free & (bit(half_lane()) - 1));
      Comparison it = member_to_compare(member, with_member);
      if (!with_member && rank < num_near) it = parcel_to_compare(near_[num_near - 1 - rank], subject);
      if (!with_member && rank == num_near && is_at_ball) it = ball_to_compare(subject, may_meet_ball);
      const Event event = compare<kBoundary>(subject, it, may_meet_ball);
      keep_earlier(best, event);
      if (first_member < num_members) is_stale |= tell(one, two, changed, first_member, event);
      if (num_free > num_near) is_at_ball = false;
      num_near -= min(num_free, num_near);
      const bool is_left =
          first_member + kHalfWarp < num_members || num_near > 0 || is_at_ball || cursor.has_more();
      if (!__any_sync(kWholeWarp, is_left)) break;
    }
    may_meet_ball = in_half_warp(may_meet_ball) != 0;
    if (__any_sync(kWholeWarp, may_meet_ball)) {
      const PathHit hit = hit_on_path_by_half_warp<kBoundary>(step_, subject.body(), may_meet_ball);
      if (half_lane() == 0) keep_hit(hit, best);
    }
    best = first_of_half(best);
    __syncwarp();
    if (half_lane() == 0 && subject.lane != kNoLane) members_[subject.lane].it.event = best;
    __syncwarp();
    return __ballot_sync(kWholeWarp, is_stale);
  }

 private:
  static constexpr unsigned kAhead = 2;

  // The member that a half of the warp predicts.
  struct Subject {
    unsigned lane;  // kNoLane: none
    const WarpMember& member;
    bool is_there;     // there is one, and it has not retired
    bool has_changed;  // it is on a new trajectory

    __device__ __forceinline__ const Trajectory& trajectory() const { return member.it.trajectory; }
    __device__ __forceinline__ ParcelNearBall body() const { return near_ball(member.it); }
  };

  // A body that a lane compares the subject with. kNoPartner: none.
  struct Comparison {
    std::uint32_t partner = kNoPartner, id = kNoPartner;  // as in Event
    std::uint32_t next_generation = 0;
    Trajectory trajectory{};  // of a parcel
  };

  __device__ __forceinline__ unsigned half_lane() const { return lane_ % kHalfWarp; }

  __device__ __forceinline__ Subject subject_of(unsigned lane, unsigned changed) const {
    const WarpMember& member = members_[lane % 32];
    const bool is_there = lane != kNoLane && !is_retired(member.it.trajectory.anchor);
    return {lane, member, is_there, (changed & bit(lane)) != 0};
  }

  // Lists the next candidates of the cursor that may collide with the subject.
  template <Boundary kBoundary>
  __device__ __forceinline__ void list_near(const MemberSearch& near, const Subject& subject,
                                            CandidateCursor<kHalfWarp, kAhead>& cursor, unsigned& num_near) {
    Candidates<kAhead> found;
    found.load_next(step_, positions_, cursor);
    for (unsigned u = 0; u < kAhead; ++u) {
      const std::uint32_t j = found.index[u], owner = found.owner[u];
      const Vec2i there = found.position[u];
      const bool is_other = j != kInvalidIndex && j != subject.member.it.index && owner != cluster_;
      const bool is_near =
          is_other && near.template holds<kBoundary>(step_.world(), there) &&
          (owner != kInvalidIndex || near.template may_hit<kBoundary>(step_, there, found.velocity[u]));
      const unsigned lanes = in_half_warp(is_near);
      if (is_near) near_[num_near + __popc(lanes & (bit(half_lane()) - 1))] = j;
      num_near += __popc(lanes);
    }
  }

  __device__ __forceinline__ Comparison member_to_compare(unsigned lane, bool is_real) const {
    if (!is_real) return {};
    const Member& it = members_[lane].it;
    return {it.index, it.id, it.next_generation, it.trajectory};
  }

  // Parcel j, outside the cluster: a free one on its start trajectory, one of another cluster on any.
  __device__ __forceinline__ Comparison parcel_to_compare(std::uint32_t j, const Subject& subject) {
    const std::uint32_t id = load_early(&memory_.trajectories.id[j]);
    if (step_.owner_of(j) != kInvalidIndex && subject.has_changed)
      add_neighbour_pair(step_, counts_, subject.member.it.index, j);
    return {j, id, 0, step_.start_trajectory(j)};
  }

  // The ball, if it is on one trajectory in the window. Otherwise, and if it is not far from that, its path
  // must be looked along.
  __device__ __forceinline__ Comparison ball_to_compare(const Subject& subject, bool& may_meet) const {
    const ExactState& state = step_.state;
    if (state.num_ball_segments > 1) {
      may_meet = state.path_is_straight == 0;
      if (may_meet) return {};
    } else if (subject.body().just_hit && step_.has_participant()) {
      return {};
    }
    return {kBallPartner, kBallPartner, 0, {}};
  }

  // The subject's event with that body.
  template <Boundary kBoundary>
  __device__ __forceinline__ Event compare(const Subject& subject, const Comparison& it,
                                           bool& may_meet_ball) const {
    const Trajectory& own = subject.trajectory();
    const bool with_ball = it.partner == kBallPartner;
    const bool is_possible =
        subject.is_there && it.partner != kNoPartner && !is_retired(it.trajectory.anchor);
    if (!is_possible) return {};
    RelativeMotion motion;
    double contact = c_.run.contact_distance;
    bool is_margin = false;
    if (with_ball) {
      is_margin = step_.state.num_ball_segments > 1;
      motion = motion_from_ball<kBoundary>(c_, ball_path(step_)[0].trajectory, own);
      contact = is_margin ? c_.run.ball_contact + kPathMargin : c_.run.ball_contact;
    } else {
      motion = motion_from_parcel<kBoundary>(c_, own, it.trajectory);
    }
    const std::uint32_t tick = contact_tick(c_.plan, motion, contact);
    if (is_margin) {
      may_meet_ball = tick != kNoTick || dot(motion.offset, motion.offset) <= contact * contact;
      return {};
    }
    const std::uint32_t own_generation = generation_of(step_, tick, own, subject.member.it.next_generation);
    const std::uint32_t other_generation =
        with_ball ? 0U : generation_of(step_, tick, it.trajectory, it.next_generation);
    return {tick, it.partner, it.id, max(own_generation, other_generation)};
  }

  // Members learn of collisions with subjects that have changed. first_member: of those that the halves'
  // lanes have just compared. event: of this lane. Returns whether this lane's member must be predicted: its
  // event is gone.
  __device__ __forceinline__ bool tell(unsigned one, unsigned two, unsigned changed, unsigned first_member,
                                       const Event& event) {
    const bool is_told = is_member() && (changed & bit(lane_)) == 0 &&
                         lane_ / kHalfWarp == first_member / kHalfWarp &&
                         !is_retired(mine_.it.trajectory.anchor);
    bool is_stale = false;
    for (unsigned k = 0; k < 2; ++k) {
      const unsigned subject = k == 0 ? one : two;
      if ((changed & bit(subject)) == 0) continue;
      const unsigned source = k * kHalfWarp + half_lane();
      const Member& other = members_[subject].it;
      const Event collision{from(event.tick, source), other.index, other.id, from(event.generation, source)};
      if (!is_told) continue;
      Event& own = mine_.it.event;
      if (own.partner == collision.partner) {
        is_stale = true;
        own = {};
      } else {
        keep_earlier(own, collision);
      }
    }
    return is_stale;
  }

  // The first event of a half's lanes, in all of them.
  __device__ __forceinline__ Event first_of_half(const Event& event) const {
    const auto lowest = [](std::uint32_t value) {
      for (unsigned offset = kHalfWarp / 2; offset > 0; offset /= 2)
        value = min(value, __shfl_xor_sync(kWholeWarp, value, offset));
      return value;
    };
    bool among = event.tick == lowest(event.tick);
    const bool is_tied = __popc(in_half_warp(among)) > 1;
    if (__any_sync(kWholeWarp, is_tied && event.tick != kNoTick)) {
      const std::uint32_t generation = lowest(among ? event.generation : kNoTick);
      among = among && event.generation == generation;
      const std::uint32_t partner_id = lowest(among ? event.partner_id : kNoPartner);
      among = among && event.partner_id == partner_id;
    }
    return from(event, (lane_ & kHalfWarp) + first_of(in_half_warp(among)));
  }

  std::uint32_t* near_;  // of this half
};

}  // namespace pf::cuda
