// Method `exact` on the CPU: one cluster's events through a step, in the order of time, as if the other
// parcels kept to the lines that they have at its begin. Where one of them turns out to be another cluster's,
// it stops.
#pragma once

#include <algorithm>

#include "backend/exact/step_state.hpp"

namespace pf {

template <Boundary kBoundary>
class ClusterSolver {
 public:
  ClusterSolver(ExactStep<kBoundary>& step, WorkerState& worker, std::uint32_t thread, std::uint32_t index,
                Cluster& cluster)
      : step_(step), c_(step.c), worker_(worker), index_(index), cluster_(cluster) {
    cluster_.thread = thread;
    cluster_.first_member = static_cast<std::uint32_t>(worker_.members.size());
    cluster_.first_event = static_cast<std::uint32_t>(worker_.events.size());
    cluster_.num_members = cluster_.num_events = 0;
    cluster_.is_solved = false;
    cluster_.fastest2 = 0.0;
    cluster_.event_hash = 0;
    cluster_.tally = {};
  }

  // cluster.is_solved, or worker.conflicts has the other cluster.
  void solve() {
    first_neighbour_pair_ = worker_.neighbour_pairs.size();
    worker_.queue.clear();
    for (std::uint32_t k = 0; k < cluster_.num_seeds; ++k) {
      const std::uint32_t i = step_.seeds[cluster_.first_seed + k];
      push(add(i));
    }
    if (cluster_.has_ball) start_ball();
    cluster_.is_solved = process_events();
    cluster_.num_members = static_cast<std::uint32_t>(worker_.members.size()) - cluster_.first_member;
    if (!cluster_.is_solved) worker_.neighbour_pairs.resize(first_neighbour_pair_);
  }

 private:
  static constexpr std::uint32_t kBallMember = 0xFFFFFFFEU;

  Member& member(std::uint32_t m) { return worker_.members[m]; }
  std::uint32_t id(std::uint32_t parcel) const { return step_.trajectories.id[parcel]; }
  BallMember& ball() { return step_.ball_member; }

  std::uint32_t add(std::uint32_t i) {
    const auto m = static_cast<std::uint32_t>(worker_.members.size());
    Member now;
    now.index = i;
    now.trajectory = step_.trajectory(i);
    const std::uint32_t partner = step_.event_partner[i];
    const std::uint64_t key = step_.event_key[i];
    if (key != kNoEvent)
      now.event = {static_cast<std::uint32_t>(key >> 32U), partner, static_cast<std::uint32_t>(key)};
    now.last_contact_tick = step_.trajectories.last_contact_tick.empty() ? 0U : step_.trajectories.last_contact_tick[i];
    worker_.members.push_back(now);
    step_.member_slot[i] = m;
    return m;
  }

  // The parcel's place among the members, which it joins if it is nobody's; kNone if it is another cluster's.
  std::uint32_t join(std::uint32_t i) {
    if (step_.owner_of(i) == index_) return step_.member_slot[i];
    const std::uint32_t owner = step_.take(step_.owner[i], index_);
    if (owner == index_) return add(i);
    worker_.conflicts.push_back({index_, owner});
    return kInvalidIndex;
  }

  // ---- the queue

  static bool is_later(const WorkerState::Entry& a, const WorkerState::Entry& b) {
    if (a.tick != b.tick) return a.tick > b.tick;
    if (a.low != b.low) return a.low > b.low;
    return a.high > b.high;
  }
  void push(std::uint32_t m, std::uint32_t own_id, const Event& event, std::uint32_t version) {
    if (event.tick == kNoTick) return;
    worker_.queue.push_back(
        {event.tick, std::min(own_id, event.partner_id), std::max(own_id, event.partner_id), m, version});
    std::push_heap(worker_.queue.begin(), worker_.queue.end(), is_later);
  }
  void push(std::uint32_t m) { push(m, id(member(m).index), member(m).event, member(m).version); }

  void set_event(std::uint32_t m, const Event& event) {
    ++member(m).version;
    member(m).event = event;
    push(m);
  }
  void set_ball_event(const Event& event) {
    ++ball().version;
    ball().event = event;
    push(kBallMember, kBallPartner, event, ball().version);
  }

  bool process_events() {
    while (!worker_.queue.empty()) {
      const WorkerState::Entry next = worker_.queue.front();
      std::pop_heap(worker_.queue.begin(), worker_.queue.end(), is_later);
      worker_.queue.pop_back();
      const bool is_ball = next.member == kBallMember;
      if (next.version != (is_ball ? ball().version : member(next.member).version)) continue;
      if (cluster_.num_events == step_.problem.max_events) return true;  // too many: the step is given up
      if (!(is_ball ? apply_ball_event() : apply_event(next.member))) return false;
    }
    return true;
  }

  // ---- events

  void record(std::uint32_t tick, std::uint32_t first, std::uint32_t second) {
    const std::uint64_t at =
        step_.problem.start_tick + (static_cast<std::uint64_t>(tick) << step_.problem.tick_exponent);
    const std::uint32_t low = std::min(first, second), high = std::max(first, second);
    cluster_.event_hash += event_hash(at, low, high);
    ++cluster_.num_events;
    if (step_.recording) worker_.events.push_back({at, low, high});
  }

  // Whether an event of m at `tick` comes so soon after its last one that it loses nothing (the TC model).
  bool in_contact_time(std::uint32_t m, std::uint32_t tick) {
    return c_.plan.contact_duration_ticks != 0 && c_.plan.start + tick - member(m).last_contact_tick <= c_.plan.contact_duration_ticks;
  }

  void store(std::uint32_t m, const Trajectory& now, std::uint32_t tick) {
    Member& it = member(m);
    if (it.has_changed) {
      worker_.segments.push_back({it.trajectory, tick, it.segments});
      it.segments = static_cast<std::uint32_t>(worker_.segments.size()) - 1;
    }
    const float speed2 = dot(now.velocity, now.velocity);
    it.trajectory = now;
    it.has_changed = true;
    cluster_.fastest2 = std::max(cluster_.fastest2, static_cast<double>(speed2));
  }

  bool apply_event(std::uint32_t m) {
    const Event event = member(m).event;
    if (is_parcel(event.partner)) {
      const std::uint32_t other = join(event.partner);
      if (other == kInvalidIndex) return false;
      if (is_out_of_date(m, other))
        repredict(m);
      else
        apply_pair_event(m, other, event.tick);
      return true;
    }
    if (event.partner != kBallPartner) {
      apply_edge_event(m, event);
    } else if (step_.has_participant()) {
      worker_.conflicts.push_back({index_, step_.ball_owner});
      return false;
    } else {
      hit_ball(m, event.tick, step_.ball.trajectory);
      predict_changed(m);
    }
    return true;
  }

  // Whether the partner of m's event has left the line that the event was predicted on; nobody told m. Its
  // true next event is not earlier: that would have taken the other's place.
  bool is_out_of_date(std::uint32_t m, std::uint32_t partner) {
    const Member& other = member(partner);
    if (!other.has_changed) return false;
    return is_retired(other.trajectory.anchor) ||
           collision_tick<kBoundary>(c_, member(m).trajectory, other.trajectory) != member(m).event.tick;
  }

  void apply_pair_event(std::uint32_t one, std::uint32_t other, std::uint32_t tick) {
    const bool in_order = id(member(one).index) < id(member(other).index);
    const std::uint32_t a = in_order ? one : other, b = in_order ? other : one;
    Trajectory first = member(a).trajectory, second = member(b).trajectory;
    anchor_at<kBoundary>(c_, first, tick);
    anchor_at<kBoundary>(c_, second, tick);
    const bool elastic = in_contact_time(a, tick) || in_contact_time(b, tick);
    collide<kBoundary>(c_, first, second, elastic, cluster_.tally);
    store(a, first, tick);
    store(b, second, tick);
    member(a).last_contact_tick = member(b).last_contact_tick = c_.plan.start + tick;
    record(tick, id(member(a).index), id(member(b).index));
    const auto mover = [&](std::uint32_t m) {
      return Mover{member(m).index, step_.disc_of(member(m).index, member(m).trajectory)};
    };
    step_.search({mover(a), mover(b)}, worker_.candidates);
    predict_changed(a, b, worker_.candidates[0]);
    predict_changed(b, a, worker_.candidates[1]);
  }

  void apply_edge_event(std::uint32_t m, const Event& event) {
    Trajectory now = member(m).trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    collide_with_edge(c_, event.partner, now);
    if (event.partner == kExit) cluster_.tally.retired();
    store(m, now, event.tick);
    member(m).last_contact_tick = c_.plan.start + event.tick;
    record(event.tick, id(member(m).index), event.partner);
    predict_changed(m);
  }

  BallReaction hit_ball(std::uint32_t m, std::uint32_t tick, const BallTrajectory& trajectory) {
    Trajectory now = member(m).trajectory;
    anchor_at<kBoundary>(c_, now, tick);
    const BallReaction kick = collide_with_ball<kBoundary>(c_, trajectory, tick, now, cluster_.tally);
    store(m, now, tick);
    record(tick, id(member(m).index), kBallPartner);
    return kick;
  }

  bool apply_ball_event() {
    const Event event = ball().event;
    BallReaction kick{};
    std::uint32_t m = kInvalidIndex;
    if (is_parcel(event.partner)) {
      m = join(event.partner);
      if (m == kInvalidIndex) return false;
      kick = hit_ball(m, event.tick, ball().now.trajectory);
    } else {
      record(event.tick, event.partner, kBallPartner);
    }
    if (ball().has_changed) ball().segments.push_back({ball().now.trajectory, event.tick});
    apply_to_ball(c_, event.tick, event.partner, kick, ball().now);
    ball().has_changed = true;
    ball().fastest_mps = std::max(ball().fastest_mps, surface_speed_mps(c_.run.physics, ball().now.trajectory));
    ball().event = {};
    if (m != kInvalidIndex) predict_changed(m);
    predict_ball();
    return true;
  }

  // ---- the ball as a member

  void start_ball() {
    ball().now = step_.ball;
    ball().has_changed = false;
    ball().fastest_mps = 0.0;
    ball().segments.clear();
    ball().version = 0;
    predict_ball();
  }

  Trajectory current_trajectory(std::uint32_t k) {
    return step_.owner_of(k) == index_ ? member(step_.member_slot[k]).trajectory : step_.trajectory(k);
  }

  void predict_ball() {
    Event best;
    const BallTrajectory& trajectory = ball().now.trajectory;
    for (const std::uint32_t k : step_.near_ball) {
      const Trajectory there = current_trajectory(k);
      if (is_retired(there.anchor)) continue;
      keep_earlier(best, {ball_collision_tick<kBoundary>(c_, trajectory, there), k, id(k)});
    }
    keep_ball_edge_event<kBoundary>(c_, trajectory, best);
    set_ball_event(best);
  }

  // The ball's event after member m, on a new line, may have come between.
  void update_ball_event(const Member& changed) {
    if (ball().event.partner == changed.index) return predict_ball();
    if (is_retired(changed.trajectory.anchor) || !step_.is_near_ball(changed.index)) return;
    const Event now{ball_collision_tick<kBoundary>(c_, ball().now.trajectory, changed.trajectory), changed.index,
                    id(changed.index)};
    if (now.tick != kNoTick && comes_before(now, ball().event)) set_ball_event(now);
  }

  // ---- predictions

  void keep_edge_and_ball(const Member& it, Event& best) const {
    if (may_reach_edge<kBoundary>(c_, step_.problem.present[it.index]))
      keep_edge_event<kBoundary>(c_, it.trajectory, best);
    if (c_.plan.ball == BallRole::absent || cluster_.has_ball || !step_.is_near_ball(it.index)) return;
    keep_earlier(best, {ball_collision_tick<kBoundary>(c_, step_.ball.trajectory, it.trajectory), kBallPartner, kBallPartner});
  }

  void predict_changed(std::uint32_t m) {
    if (is_retired(member(m).trajectory.anchor)) {
      set_event(m, {});
      if (cluster_.has_ball) update_ball_event(member(m));
      return;
    }
    step_.search(member(m).index, member(m).trajectory, worker_.candidates[0]);
    predict_changed(m, kInvalidIndex, worker_.candidates[0]);
  }

  // Of a member on a new line: its next event, and that of members that it meets before theirs. `partner`
  // changed as well and has its own turn. Those whose event was with the member's old line find out when it
  // is due.
  void predict_changed(std::uint32_t m, std::uint32_t partner, const Candidates& candidates) {
    const Member it = member(m);
    Event best;
    for (const std::uint32_t j : candidates.overlapping) {
      const std::uint32_t owner = step_.owner_of(j);
      if (owner == index_) {
        predict_between(it, j, partner, best);
        continue;
      }
      if (owner != kInvalidIndex) worker_.neighbour_pairs.push_back({it.index, j});
      keep_earlier(best, {collision_tick<kBoundary>(c_, it.trajectory, step_.trajectory(j)), j, id(j)});
    }
    for (const std::uint32_t j : candidates.owned) {
      if (step_.owner_of(j) == index_)
        predict_between(it, j, partner, best);
      else
        worker_.neighbour_pairs.push_back({it.index, j});
    }
    keep_edge_and_ball(it, best);
    set_event(m, best);
    if (cluster_.has_ball) update_ball_event(it);
  }

  // Its event with member j, for both.
  void predict_between(const Member& it, std::uint32_t j, std::uint32_t partner, Event& best) {
    const std::uint32_t n = step_.member_slot[j];
    const Member& other = member(n);
    if (is_retired(other.trajectory.anchor)) return;
    const std::uint32_t tick = collision_tick<kBoundary>(c_, it.trajectory, other.trajectory);
    keep_earlier(best, {tick, j, id(j)});
    const Event now{tick, it.index, id(it.index)};
    if (n != partner && tick != kNoTick && comes_before(now, other.event)) set_event(n, now);
  }

  // Of a member on the line that it was on.
  void repredict(std::uint32_t m) {
    const Member it = member(m);
    Candidates& candidates = worker_.candidates[0];
    step_.search(it.index, it.trajectory, candidates);
    Event best;
    const auto consider = [&](std::uint32_t j, const Trajectory& there) {
      if (!is_retired(there.anchor)) keep_earlier(best, {collision_tick<kBoundary>(c_, it.trajectory, there), j, id(j)});
    };
    for (const std::uint32_t j : candidates.overlapping) consider(j, current_trajectory(j));
    for (const std::uint32_t j : candidates.owned) {
      if (step_.owner_of(j) == index_) consider(j, member(step_.member_slot[j]).trajectory);
    }
    keep_edge_and_ball(it, best);
    set_event(m, best);
  }

  ExactStep<kBoundary>& step_;
  const ExactConstants& c_;
  WorkerState& worker_;
  std::uint32_t index_;
  Cluster& cluster_;
  std::size_t first_neighbour_pair_ = 0;
};

}  // namespace pf
