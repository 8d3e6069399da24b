// Method `exact` on the device: a warp solves a cluster, as the CPU's ClusterSolver does with one thread.
// Each lane keeps a member in its registers.
#pragma once

#include "cuda/exact/solve_warp_predict.cuh"

namespace pf::cuda {

template <Boundary kBoundary>
class WarpSolver : WarpPredictions {
 public:
  __device__ __forceinline__ WarpSolver(const StepContext& step, WarpSpace& space, BlockCounts& counts)
      : WarpPredictions(step, space, counts), max_events_(step.state.max_events) {}

  // Solves the cluster. list: slot of its first member. All lanes call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    cluster_ = cluster;
    attempt_ = counts_.round * kMaxAttemptsInRound;
    bool fits = false, solved = false;
    do {
      tally_ = {};
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
    const Event& own = it_.event;
    return first_lane({is_member() ? own.tick : kNoTick, own.generation, min(it_.id, own.partner_id),
                       max(it_.id, own.partner_id)});
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
      const Event event = from(it_.event, own);
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
        const BallTrajectory& ball =
            note_hit(step_, event.generation,
                     {event.tick, it_.id, cluster_, attempt_, it_.trajectory, it_.next_generation});
        collide_with_ball<kBoundary>(c_, ball, event.tick, now, tally_);
      } else {
        apply_edge(c_, event.partner, now);
      }
    }
    if (event.partner == kExit) tally_.retired();
    if (!takes_part) return;
    keep_segment(step_, counts_, event, it_);
    set_trajectory(now, event, it_, tally_);
    if (event.partner != kBallPartner)
      it_.last_contact_tick = c_.plan.start + event.tick;
    else
      it_.has_changed = kHitBall;
  }

  std::uint32_t max_events_;
};

}  // namespace pf::cuda
