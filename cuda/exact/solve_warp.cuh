// Method `exact` on the device: a warp solves a cluster, as the CPU's ClusterSolver does with one thread.
#pragma once

#include "cuda/exact/solve_warp_predict.cuh"

namespace pf::cuda {

template <Boundary kBoundary>
class WarpSolver : WarpPredictions {
 public:
  __device__ __forceinline__ WarpSolver(const StepContext& step, WarpSpace& space, SliceCounts& counts)
      : WarpPredictions(step, space, counts), max_events_(step.state.max_events) {}

  // Solves the cluster. list: slot of its first member. All lanes call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    cluster_ = cluster;
    attempt_ = counts_.round * kMaxAttemptsInRound;
    bool fits = false, solved = false;
    do {
      if (lane_ == 0) tally_ = {};
      fastest2_ = 0.0F;
      ++attempt_;
      other_ = kInvalidIndex;
      fits = load_members<kBoundary>(list);
      if (!fits) other_ = cluster;
      solved = fits && process_events();
    } while (!solved && absorb(list));
    finish(list, fits, solved);
  }

 private:
  // ---- events

  // Lane of the member whose event comes first, or kNoLane.
  __device__ __forceinline__ unsigned next_event() const {
    const Member& it = mine_.it;
    const Event own = it.event;
    return first_lane({is_member() ? own.tick : kNoTick, own.generation, min(it.id, own.partner_id),
                       max(it.id, own.partner_id)});
  }

  // Applies events in their order up to the window's end. Returns false if another cluster owns a partner.
  __device__ __forceinline__ bool process_events() {
    while (true) {
      const unsigned own = next_event();
      if (own == kNoLane) return true;
      if (tally_.num_events == max_events_) {
        if (lane_ == own) stop_at(step_, mine_.it.event.tick);
        return true;
      }
      const Event event = members_[own].it.event;
      unsigned other = kNoLane;
      if (is_parcel(event.partner)) {
        other = lane_of(event.partner);
        if (other == kNoLane) return false;
      } else if (event.partner == kBallPartner && ball_joins(step_)) {
        std::uint32_t owner = kInvalidIndex;
        if (lane_ == 0) owner = claim_ball(step_, cluster_);
        owner = from(owner, 0);
        other_ = owner == kInvalidIndex ? cluster_ : owner;
        return false;
      }
      apply_event(event, own, other);
      unsigned stale = bit(own) | bit(other);
      const unsigned changed = stale;
      while (stale != 0) {
        const unsigned one = first_of(stale);
        stale &= stale - 1;
        const unsigned two = stale != 0 ? first_of(stale) : kNoLane;
        stale &= stale - 1;
        stale |= predict<kBoundary>(one, two, changed);
      }
    }
  }

  // Applies the event of lane `own`; other: the partner's lane, or kNoLane.
  __device__ __forceinline__ void apply_event(const Event& event, unsigned own, unsigned other) {
    Member& it = mine_.it;
    Trajectory now = it.trajectory;
    const bool takes_part = lane_ == own || lane_ == other;
    if (takes_part) anchor_at<kBoundary>(c_, now, event.tick);
    const std::uint32_t id = members_[own].it.id;
    const std::uint32_t low = min(id, event.partner_id), high = max(id, event.partner_id);
    ClusterTally tally;
    tally.event_hash = event_hash(step_.since_reset(event.tick), low, high);
    tally.num_events = 1;
    if (other != kNoLane) {
      const bool recent = takes_part && is_in_contact(c_.plan, event.tick, it.last_contact_tick);
      const unsigned first_lane = id == low ? own : other;
      Trajectory first = from(now, first_lane), second = from(now, id == low ? other : own);
      collide<kBoundary>(c_, first, second, __any_sync(kWholeWarp, recent) != 0, tally);
      now = lane_ == first_lane ? first : second;
    } else if (lane_ == own) {
      if (event.partner == kBallPartner) {
        const BallTrajectory& ball = note_hit(
            step_, event.generation, {event.tick, id, cluster_, attempt_, it.trajectory, it.next_generation});
        collide_with_ball<kBoundary>(c_, ball, event.tick, now, tally);
      } else {
        apply_edge(c_, event.partner, now);
      }
    }
    if (event.partner == kExit) tally.retired();
    if (lane_ == own) add_tally(tally, tally_);
    if (takes_part) {
      keep_segment(step_, counts_, event, it);
      set_trajectory(now, event, it, tally);
      fastest2_ = fmaxf(fastest2_, tally.fastest2);
      if (event.partner != kBallPartner)
        it.last_contact_tick = c_.plan.start + event.tick;
      else
        it.has_changed = kHitBall;
    }
    __syncwarp();
  }

  std::uint32_t max_events_;
};

}  // namespace pf::cuda
