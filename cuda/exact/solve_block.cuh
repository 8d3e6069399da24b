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
  static constexpr std::uint32_t kMostEvents = 20000;

  __device__ __forceinline__ BlockSolver(const ExactLaunch& launch, const ExactConstants& c,
                                         ExactState& state, BlockSpace& space, BlockCounts& counts)
      : Base(launch, c, state, space, counts) {}

  // Solves the cluster, `list` being its members. All threads call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    cluster_ = cluster;
    sum_ = {};
    has_ball_ = c_.ball == BallRole::participant && load_fresh(&state_.ball_owner) == cluster;
    if (leads()) {
      space_.num_members = 0;
      space_.num_flagged = 0;
      space_.other = kNone;
    }
    sync();
    const bool fits = load_members(list);
    if (fits && has_ball_) begin_ball();
    const bool solved = fits && go_through_events();
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
    uint4 best{kNoTick, kNone, kNone, kNone};
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
  __device__ __forceinline__ bool go_through_events() {
    bool ball_is_stale = has_ball_;
    while (true) {
      if (ball_is_stale) predict_ball();
      const uint4 next = next_event();
      if (next.x == kNoTick) return true;
      if (sum_.num_events == kMostEvents) {
        if (leads()) state_.failed = 1;
        return true;
      }
      const Event event = next.w == kBall ? state_.ball_event : member(next.w).event;
      std::uint32_t m = next.w, other = kNone;
      if (is_parcel(event.partner)) {
        const std::uint32_t joined = join(event.partner);
        if (joined == kNone) return false;
        (next.w == kBall ? m : other) = joined;
      } else if (event.partner == kBallPartner && c_.ball == BallRole::participant) {
        if (leads()) space_.other = load_fresh(&state_.ball_owner);
        return false;
      }
      sync();
      if (leads()) {
        if (other != kNone) {
          collide_members(m, other, event.tick);
        } else if (next.w == kBall || event.partner == kBallPartner) {
          meet_ball(m, event);
        } else {
          meet_the_edge(m, event);
        }
        space_.num_flagged = 0;
        if (m != kBall) flagged_[space_.num_flagged++] = m;
        if (other != kNone) flagged_[space_.num_flagged++] = other;
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
    return c_.clock_ticks != 0 && c_.begin + tick - it.clock <= c_.clock_ticks;
  }

  // What an event does; called by the first thread.
  __device__ __forceinline__ void collide_members(std::uint32_t m, std::uint32_t n, std::uint32_t tick) {
    const bool in_order = member(m).id < member(n).id;
    ClusterMember &one = member(in_order ? m : n), &two = member(in_order ? n : m);
    Line first = one.line, second = two.line;
    anchor_at<kBoundary>(c_, first, tick);
    anchor_at<kBoundary>(c_, second, tick);
    const bool elastic = in_contact_time(one, tick) || in_contact_time(two, tick);
    collide<kBoundary>(c_, first, second, elastic, sum_);
    put_on_line(a_, counts_, state_, first, tick, one, sum_);
    put_on_line(a_, counts_, state_, second, tick, two, sum_);
    one.clock = two.clock = c_.begin + tick;
  }

  __device__ __forceinline__ void meet_the_edge(std::uint32_t m, const Event& event) {
    ClusterMember& it = member(m);
    Line now = it.line;
    anchor_at<kBoundary>(c_, now, event.tick);
    meet_edge(c_, event.partner, now);
    if (event.partner == kExit) ++sum_.num_retired;
    put_on_line(a_, counts_, state_, now, event.tick, it, sum_);
    it.clock = c_.begin + event.tick;
  }

  // A member, and the ball if it takes part; or that at a wall, and m is none.
  __device__ __forceinline__ void meet_ball(std::uint32_t m, const Event& event) {
    ExactBall ball = has_ball_ ? state_.ball_now : state_.ball;
    BallKick kick{};
    if (m != kBall) {
      ClusterMember& it = member(m);
      Line now = it.line;
      anchor_at<kBoundary>(c_, now, event.tick);
      kick = collide_with_ball<kBoundary>(c_, ball.line, event.tick, now, sum_);
      put_on_line(a_, counts_, state_, now, event.tick, it, sum_);
    }
    if (!has_ball_) return;
    if (state_.ball_has_changed) {
      if (state_.num_ball_segments < a_.ball_segment_capacity) {
        a_.ball_segments[state_.num_ball_segments++] = {ball.line, event.tick};
      } else {
        state_.failed = 1;
      }
    }
    change_ball(c_, event.tick, event.partner, kick, ball);
    state_.ball_now = ball;
    state_.ball_has_changed = 1;
    const double surface_mps = surface_speed_mps(c_.step.physics, ball.line);
    if (surface_mps > c_.max_speed_mps)
      atomicMax(&state_.too_fast_bits, __float_as_uint(static_cast<float>(surface_mps) * (1.0F + 1e-6F)));
  }

  // ---- the ball as a member

  __device__ __forceinline__ void begin_ball() {
    if (leads()) {
      state_.ball_now = state_.ball;
      state_.ball_has_changed = 0;
      state_.num_ball_segments = 0;
    }
    sync();
  }

  __device__ __forceinline__ Line line_now(std::uint32_t k) const {
    return owner_of(k) == cluster_ ? member(a_.place[k]).line : line_of(a_, k);
  }

  __device__ __forceinline__ void predict_ball() {
    Event best;
    const BallLine line = state_.ball_now.line;
    const std::uint32_t num = min(state_.num_near_ball, a_.near_ball.capacity);
    for (std::uint32_t n = threadIdx.x; n < num; n += kExactBlock) {
      const std::uint32_t k = a_.near_ball.items[n];
      const Line there = line_now(k);
      if (!is_retired(there.anchor))
        keep_meeting(best, meeting_ball<kBoundary>(c_, line, there), k, a_.lines.id);
    }
    best = earliest(best);
    if (leads()) {
      keep_ball_edge_event<kBoundary>(c_, line, best);
      state_.ball_event = best;
    }
    sync();
  }

  // After a member got a new line: whether the ball's event is to be predicted again, or is this parcel's
  // now.
  __device__ __forceinline__ bool heed_ball(std::uint32_t i, const Line& now) {
    const Event event = state_.ball_event;
    sync();
    if (event.partner == i) return true;
    if (leads() && !is_retired(now.anchor) &&
        is_near_ball<kBoundary>(c_.step.physics.world, state_, present_[i])) {
      const Event next{meeting_ball<kBoundary>(c_, state_.ball_now.line, now), i, id(i)};
      if (next.tick != kNoTick && comes_before(next, event)) state_.ball_event = next;
    }
    sync();
    return false;
  }

  // ---- predictions

  // visit(j) for the parcels of i's search box, i among them, shared among the threads.
  template <class Visit>
  __device__ __forceinline__ void each_in_box(Vec2i at, std::int32_t reach, Visit visit) {
    search<kBoundary, false, kExactBlock>(launch_.space, present_, at, kNone, reach, 3.4e38F,
                                          [&](std::uint32_t j, Vec2i) { visit(j); });
  }

  // visit(j, owner) for the parcels that i, on the line `now` and never faster than fastest_mps in the step,
  // may touch, but for the members of its cluster; those that are another's, on whatever line they are.
  template <class Visit>
  __device__ __forceinline__ void search_others(std::uint32_t i, const Line& now, float fastest_mps,
                                                Visit visit) {
    if (!c_.step.physics.parcels.contacts) return;
    const double in_step = c_.units_per_tick * c_.length;
    const double moved = (static_cast<double>(fastest_mps) + c_.max_speed_mps) * in_step;
    const double distance = c_.step.contact_distance + moved + kRoundingMargin;
    const float within = filter_of(distance);
    const auto contact = static_cast<float>(c_.step.contact_distance);
    const auto per_mps = static_cast<float>(in_step);
    const Vec2i at = present_[i];
    const Vec2i begin = line_begin<kBoundary>(c_, now);
    const World& world = launch_.space.world;
    each_in_box(at, saturated(distance + static_cast<double>(state_.progress.travel)), [&](std::uint32_t j) {
      const std::uint32_t owner = owner_of(j);
      const Vec2i there = present_[j];
      const Vec2f velocity = a_.lines.velocity[j];
      const Vec2i offset = separation<kBoundary>(world, at, there);
      const auto x = static_cast<float>(offset.x), y = static_cast<float>(offset.y);
      if (x * x + y * y >= within || owner == cluster_ || j == i) return;
      if (owner == kNone &&
          !may_meet(separation<kBoundary>(world, begin, there), velocity - now.velocity, contact, per_mps))
        return;
      visit(j, owner);
    });
  }

  __device__ __forceinline__ void keep_edge_and_ball(std::uint32_t i, const Line& now, Event& best) const {
    if (may_reach_edge<kBoundary>(c_, present_[i])) keep_edge_event<kBoundary>(c_, now, best);
    if (c_.ball == BallRole::absent || has_ball_ ||
        !is_near_ball<kBoundary>(c_.step.physics.world, state_, present_[i]))
      return;
    keep_earlier(best, {meeting_ball<kBoundary>(c_, state_.ball.line, now), kBallPartner, kBallPartner});
  }

  // A member's next event. Of one on a new line also those of the members near it: they are told of an
  // earlier one, or flagged if theirs was with it; `partner` changed as well and has its own turn.
  __device__ __forceinline__ void predict(std::uint32_t m, bool has_changed, std::uint32_t partner,
                                          bool& ball_is_stale) {
    const Line now = member(m).line;
    const std::uint32_t i = member(m).index, own = member(m).id;
    const bool gone = is_retired(now.anchor);
    Event best;
    search_others(i, now, member(m).fastest_mps, [&](std::uint32_t j, std::uint32_t owner) {
      const Line there = line_of(a_, j);
      if (gone || is_retired(there.anchor)) return;
      if (owner != kNone && has_changed) add_border(a_, counts_, state_, i, j);
      keep_meeting(best, meeting<kBoundary>(c_, now, there), j, a_.lines.id);
    });
    if (c_.step.physics.parcels.contacts) {
      for (std::uint32_t k = threadIdx.x; k < num_members(); k += kExactBlock) {
        const std::uint32_t n = table_[k];
        ClusterMember& other = member(n);
        if (n == m || is_retired(other.line.anchor)) continue;
        const std::uint32_t tick = gone ? kNoTick : meeting<kBoundary>(c_, now, other.line);
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
    if (has_ball_ && has_changed && !ball_is_stale) ball_is_stale = heed_ball(i, now);
  }
};

}  // namespace pf
