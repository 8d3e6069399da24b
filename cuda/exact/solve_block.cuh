// Method `exact` on the device: a large cluster's events through a step, or those of the ball's, solved by
// the threads of a block. backend/exact_cluster_solver.hpp has the same for one thread; what is said there
// holds here.
#pragma once

#include "cuda/exact/solve_block_members.cuh"

namespace pf {

// All threads walk through the cluster together; the first one writes what there is one of.
template <Boundary kBoundary>
class BlockSolver : BlockMembers<kBoundary> {
 public:
  using Base = BlockMembers<kBoundary>;
  static constexpr std::uint32_t kMaxEvents = 20000;

  __device__ __forceinline__ BlockSolver(const ExactLaunch& launch, const ExactConstants& c,
                                         ExactState& state, BlockSpace& space, BlockCounts& counts)
      : Base(launch, c, state, space, counts) {}

  // Solves the cluster, `list` being its members. All threads call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    cluster_ = cluster;
    sum_ = {};
    has_ball_ = c_.plan.ball == BallRole::participant && load_fresh(&state_.ball_owner) == cluster;
    if (leads()) {
      space_.num_members = 0;
      space_.num_flagged = 0;
      space_.other = kInvalidIndex;
    }
    sync();
    const bool fits = load_members(list);
    if (fits && has_ball_) start_ball();
    const bool solved = fits && process_events();
    sync();
    if (leads()) finish(list, fits, solved);
    sync();
  }

 private:
  using Base::a_;
  using Base::c_;
  using Base::cluster_;
  using Base::counts_;
  using Base::earliest;
  using Base::finish;
  using Base::flagged_;
  using Base::has_ball_;
  using Base::id;
  using Base::is_before;
  using Base::join;
  using Base::launch_;
  using Base::leads;
  using Base::least;
  using Base::load_members;
  using Base::member;
  using Base::num_members;
  using Base::owner_of;
  using Base::present_;
  using Base::space_;
  using Base::state_;
  using Base::sum_;
  using Base::sync;
  using Base::table_;

  static constexpr std::uint32_t kBall = 0xFFFFFFFEU;  // in place of a member

  // ---- events

  static __device__ __forceinline__ uint4 key_of(std::uint32_t own, const Event& event, std::uint32_t who) {
    return {event.tick, own < event.partner_id ? own : event.partner_id,
            own < event.partner_id ? event.partner_id : own, who};
  }

  // The earliest event of all; its w is the member that has it, or kBall.
  __device__ __forceinline__ uint4 next_event() {
    uint4 best{kNoTick, kInvalidIndex, kInvalidIndex, kInvalidIndex};
    for (std::uint32_t k = threadIdx.x; k < num_members(); k += kExactBlock) {
      const ClusterMember& it = member(table_[k]);
      const uint4 key = key_of(it.id, it.event, table_[k]);
      if (key.x != kNoTick && is_before(key, best)) best = key;
    }
    best = least(best);
    if (has_ball_) {
      const uint4 key = key_of(kBallPartner, state_.ball_event, kBall);
      if (key.x != kNoTick && is_before(key, best)) best = key;
    }
    sync();
    return best;
  }

  // Every step of the loop stands once in the program: all is inlined, so that what the kernel was given
  // stays in the constant bank.
  __device__ __forceinline__ bool process_events() {
    bool ball_is_stale = has_ball_;
    while (true) {
      if (ball_is_stale) predict_ball();
      const uint4 next = next_event();
      if (next.x == kNoTick) return true;
      if (sum_.num_events == kMaxEvents) {
        if (leads()) state_.solve_failed = 1;
        return true;
      }
      const Event event = next.w == kBall ? state_.ball_event : member(next.w).event;
      std::uint32_t m = next.w, other = kInvalidIndex;
      if (is_parcel(event.partner)) {
        const std::uint32_t joined = join(event.partner);
        if (joined == kInvalidIndex) return false;
        (next.w == kBall ? m : other) = joined;
      } else if (event.partner == kBallPartner && c_.plan.ball == BallRole::participant) {
        if (leads()) space_.other = load_fresh(&state_.ball_owner);
        return false;
      }
      sync();
      if (leads()) {
        if (other != kInvalidIndex) {
          apply_pair_event(m, other, event.tick);
        } else if (next.w == kBall || event.partner == kBallPartner) {
          apply_ball_event(m, event);
        } else {
          apply_edge_event(m, event);
        }
        space_.num_flagged = 0;
        if (m != kBall) flagged_[space_.num_flagged++] = m;
        if (other != kInvalidIndex) flagged_[space_.num_flagged++] = other;
      }
      record(next);
      sync();
      const std::uint32_t num_changed = space_.num_flagged;
      ball_is_stale = next.w == kBall;
      for (std::uint32_t k = 0; k < space_.num_flagged; ++k)
        predict(flagged_[k], k < num_changed, k == 0 ? other : m, ball_is_stale);
      sync();
    }
  }

  // By all threads, so that num_events is the same in all.
  __device__ __forceinline__ void record(const uint4& event) {
    sum_.event_hash += event_hash(since_reset(state_, event.x), event.y, event.z);
    ++sum_.num_events;
  }

  __device__ __forceinline__ bool in_contact_time(const ClusterMember& it, std::uint32_t tick) const {
    return c_.plan.contact_duration_ticks != 0 && c_.plan.start + tick - it.last_contact_tick <= c_.plan.contact_duration_ticks;
  }

  // What an event does; called by the first thread.
  __device__ __forceinline__ void apply_pair_event(std::uint32_t m, std::uint32_t n, std::uint32_t tick) {
    const bool in_order = member(m).id < member(n).id;
    ClusterMember &one = member(in_order ? m : n), &two = member(in_order ? n : m);
    Trajectory first = one.trajectory, second = two.trajectory;
    anchor_at<kBoundary>(c_, first, tick);
    anchor_at<kBoundary>(c_, second, tick);
    const bool elastic = in_contact_time(one, tick) || in_contact_time(two, tick);
    collide<kBoundary>(c_, first, second, elastic, sum_);
    set_trajectory(a_, counts_, state_, first, tick, one, sum_);
    set_trajectory(a_, counts_, state_, second, tick, two, sum_);
    one.last_contact_tick = two.last_contact_tick = c_.plan.start + tick;
  }

  __device__ __forceinline__ void apply_edge_event(std::uint32_t m, const Event& event) {
    ClusterMember& it = member(m);
    Trajectory now = it.trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    apply_edge(c_, event.partner, now);
    if (event.partner == kExit) ++sum_.num_retired;
    set_trajectory(a_, counts_, state_, now, event.tick, it, sum_);
    it.last_contact_tick = c_.plan.start + event.tick;
  }

  // A member, and the ball if it takes part; or that at a wall, and m is none.
  __device__ __forceinline__ void apply_ball_event(std::uint32_t m, const Event& event) {
    ExactBall ball = has_ball_ ? state_.ball_now : state_.ball;
    BallReaction kick{};
    if (m != kBall) {
      ClusterMember& it = member(m);
      Trajectory now = it.trajectory;
      anchor_at<kBoundary>(c_, now, event.tick);
      kick = collide_with_ball<kBoundary>(c_, ball.trajectory, event.tick, now, sum_);
      set_trajectory(a_, counts_, state_, now, event.tick, it, sum_);
    }
    if (!has_ball_) return;
    if (state_.ball_has_changed) {
      if (state_.num_ball_segments < a_.ball_segment_capacity) {
        a_.ball_segments[state_.num_ball_segments++] = {ball.trajectory, event.tick};
      } else {
        state_.solve_failed = 1;
      }
    }
    apply_to_ball(c_, event.tick, event.partner, kick, ball);
    state_.ball_now = ball;
    state_.ball_has_changed = 1;
    const double surface_mps = surface_speed_mps(c_.run.physics, ball.trajectory);
    if (surface_mps > c_.plan.max_speed_mps)
      atomicMax(&state_.too_fast_bits, __float_as_uint(static_cast<float>(surface_mps) * (1.0F + 1e-6F)));
  }

  // ---- the ball as a member

  __device__ __forceinline__ void start_ball() {
    if (leads()) {
      state_.ball_now = state_.ball;
      state_.ball_has_changed = 0;
      state_.num_ball_segments = 0;
    }
    sync();
  }

  __device__ __forceinline__ Trajectory current_trajectory(std::uint32_t k) const {
    return owner_of(k) == cluster_ ? member(a_.member_slot[k]).trajectory : trajectory_of(a_, k);
  }

  __device__ __forceinline__ void predict_ball() {
    Event best;
    const BallTrajectory trajectory = state_.ball_now.trajectory;
    const std::uint32_t num = min(state_.num_near_ball, a_.near_ball.capacity);
    for (std::uint32_t n = threadIdx.x; n < num; n += kExactBlock) {
      const std::uint32_t k = a_.near_ball.items[n];
      const Trajectory there = current_trajectory(k);
      if (!is_retired(there.anchor))
        keep_collision(best, ball_collision_tick<kBoundary>(c_, trajectory, there), k, a_.trajectories.id);
    }
    best = earliest(best);
    if (leads()) {
      keep_ball_edge_event<kBoundary>(c_, trajectory, best);
      state_.ball_event = best;
    }
    sync();
  }

  // After a member got a new line: whether the ball's event is to be predicted again, or is this parcel's
  // now.
  __device__ __forceinline__ bool update_ball_event(std::uint32_t i, const Trajectory& now) {
    const Event event = state_.ball_event;
    sync();
    if (event.partner == i) return true;
    if (leads() && !is_retired(now.anchor) &&
        is_in<kBoundary>(state_.ball_neighbourhood, c_.run.physics.world, present_[i])) {
      const Event next{ball_collision_tick<kBoundary>(c_, state_.ball_now.trajectory, now), i, id(i)};
      if (next.tick != kNoTick && comes_before(next, event)) state_.ball_event = next;
    }
    sync();
    return false;
  }

  // ---- predictions

  // visit(j) for the parcels of i's search box, i among them, shared among the threads.
  template <class Visit>
  __device__ __forceinline__ void each_in_box(Vec2i at, std::int32_t reach, Visit visit) {
    search<kBoundary, false, kExactBlock>(launch_.space, present_, at, kInvalidIndex, reach, 3.4e38F,
                                          [&](std::uint32_t j, Vec2i) { visit(j); });
  }

  // visit(j, owner) for the parcels that i, on the line `now` and never faster than fastest_mps in the step,
  // may touch, but for the members of its cluster; those that are another's, on whatever line they are.
  template <class Visit>
  __device__ __forceinline__ void search_others(std::uint32_t i, const Trajectory& now, float fastest_mps,
                                                Visit visit) {
    if (!c_.run.physics.parcels.contacts) return;
    const double in_step = c_.plan.units_per_tick * c_.plan.length;
    const double moved = (static_cast<double>(fastest_mps) + c_.plan.max_speed_mps) * in_step;
    const double distance = c_.run.contact_distance + moved + kRoundingMargin;
    const float within = filter_of(distance);
    const auto contact = static_cast<float>(c_.run.contact_distance);
    const auto per_mps = static_cast<float>(in_step);
    const Vec2i at = present_[i];
    const Vec2i begin = start_position<kBoundary>(c_, now);
    const World& world = launch_.space.world;
    each_in_box(at, saturated(distance + static_cast<double>(state_.progress.max_displacement)), [&](std::uint32_t j) {
      const std::uint32_t owner = owner_of(j);
      const Vec2i there = present_[j];
      const Vec2f velocity = a_.trajectories.velocity[j];
      const Vec2i offset = separation<kBoundary>(world, at, there);
      const auto x = static_cast<float>(offset.x), y = static_cast<float>(offset.y);
      if (x * x + y * y >= within || owner == cluster_ || j == i) return;
      if (owner == kInvalidIndex &&
          !may_collide(separation<kBoundary>(world, begin, there), velocity - now.velocity, contact, per_mps))
        return;
      visit(j, owner);
    });
  }

  __device__ __forceinline__ void keep_edge_and_ball(std::uint32_t i, const Trajectory& now, Event& best) const {
    if (may_reach_edge<kBoundary>(c_, present_[i])) keep_edge_event<kBoundary>(c_, now, best);
    if (c_.plan.ball == BallRole::absent || has_ball_ ||
        !is_in<kBoundary>(state_.ball_neighbourhood, c_.run.physics.world, present_[i]))
      return;
    keep_earlier(best, {ball_collision_tick<kBoundary>(c_, state_.ball.trajectory, now), kBallPartner, kBallPartner});
  }

  // A member's next event. Of one on a new line also those of the members near it: they are told of an
  // earlier one, or flagged if theirs was with it; `partner` changed as well and has its own turn.
  __device__ __forceinline__ void predict(std::uint32_t m, bool has_changed, std::uint32_t partner,
                                          bool& ball_is_stale) {
    const Trajectory now = member(m).trajectory;
    const std::uint32_t i = member(m).index, own = member(m).id;
    const bool gone = is_retired(now.anchor);
    Event best;
    search_others(i, now, member(m).fastest_mps, [&](std::uint32_t j, std::uint32_t owner) {
      const Trajectory there = trajectory_of(a_, j);
      if (gone || is_retired(there.anchor)) return;
      if (owner != kInvalidIndex && has_changed) add_neighbour_pair(a_, counts_, state_, i, j);
      keep_collision(best, collision_tick<kBoundary>(c_, now, there), j, a_.trajectories.id);
    });
    if (c_.run.physics.parcels.contacts) {
      for (std::uint32_t k = threadIdx.x; k < num_members(); k += kExactBlock) {
        const std::uint32_t n = table_[k];
        ClusterMember& other = member(n);
        if (n == m || is_retired(other.trajectory.anchor)) continue;
        const std::uint32_t tick = gone ? kNoTick : collision_tick<kBoundary>(c_, now, other.trajectory);
        if (tick != kNoTick) keep_earlier(best, {tick, other.index, other.id});
        if (!has_changed || n == partner) continue;
        if (other.event.partner == i) {
          other.event = {};
          flagged_[atomicAdd(&space_.num_flagged, 1U)] = n;
        } else if (tick != kNoTick && comes_before({tick, i, own}, other.event)) {
          other.event = {tick, i, own};
        }
      }
    }
    best = earliest(best);
    if (leads()) {
      if (!gone) keep_edge_and_ball(i, now, best);
      member(m).event = best;
    }
    sync();
    if (has_ball_ && has_changed && !ball_is_stale) ball_is_stale = update_ball_event(i, now);
  }
};

}  // namespace pf
