// Method `exact` on the CPU: solves one cluster. It applies the cluster's events to the window's end in the
// order of time, as if all other parcels kept their start trajectories. If an event is with a parcel of
// another cluster, the two clusters conflict and the solver stops.
#pragma once

#include <algorithm>

#include "backend/exact/cluster_members.hpp"

namespace pf {

template <Boundary kBoundary>
class ClusterSolver : ClusterMembers {
 public:
  // index: of the cluster in the window's clusters. Discards its earlier solution.
  ClusterSolver(WindowContext& window, std::uint32_t thread, std::uint32_t index)
      : ClusterMembers(window, thread, index) {
    cluster_.restart(thread, worker_.members.size(), worker_.events.size(), worker_.notes.size());
  }

  // Sets cluster.is_solved, or appends the other cluster to worker.conflicts.
  void solve() {
    const std::size_t num_neighbour_pairs = worker_.neighbour_pairs.size();
    worker_.queue.clear();
    for (std::uint32_t k = 0; k < cluster_.num_seeds; ++k) {
      const std::uint32_t i = memory_.seeds[cluster_.first_seed + k];
      push(add_member(i));
    }
    if (cluster_.has_ball) add_ball();
    cluster_.is_solved = process_events();
    cluster_.num_members = static_cast<std::uint32_t>(worker_.members.size()) - cluster_.first_member;
    cluster_.num_notes = static_cast<std::uint32_t>(worker_.notes.size()) - cluster_.first_note;
    if (!cluster_.is_solved)
      worker_.neighbour_pairs.resize(num_neighbour_pairs);
    else if (cluster_.num_events > 1)
      drop_repeated_pairs(num_neighbour_pairs);
  }

 private:
  static constexpr std::uint32_t kMaxEvents = 100000;  // whatever their ticks

  // A pair of neighbours is found again after each event of its member. first: of the cluster's pairs.
  void drop_repeated_pairs(std::size_t first) {
    std::vector<IndexPair>& pairs = worker_.neighbour_pairs;
    const auto begin = pairs.begin() + static_cast<std::ptrdiff_t>(first);
    std::sort(begin, pairs.end());
    pairs.erase(std::unique(begin, pairs.end()), pairs.end());
  }

  // Returns false at a conflict. With too many events it stops before the next tick as if it had finished;
  // the window is then cut there. With far too many the window is discarded.
  bool process_events() {
    while (!worker_.queue.empty()) {
      const EventQueue::Entry next = worker_.queue.pop();
      const bool is_ball = next.member == kBallMember;
      if (next.version != (is_ball ? ball().version : member(next.member).version)) continue;
      const bool has_many = cluster_.num_events >= window_.max_events && next.tick > cluster_.last_tick;
      cluster_.has_failed = cluster_.num_events == kMaxEvents;
      if (has_many || cluster_.has_failed) {
        cluster_.stopped_at = next.tick;
        return true;
      }
      if (!(is_ball ? apply_ball_event() : apply_event(next.member))) return false;
    }
    return true;
  }

  // ---- events

  bool apply_event(std::uint32_t m) {
    const Event event = member(m).event;
    if (is_parcel(event.partner)) {
      const std::uint32_t other = join(event.partner);
      if (other == kInvalidIndex) return false;
      if (is_stale(m, other))
        repredict(m);
      else
        apply_pair_event(m, other, event);
      return true;
    }
    if (event.partner != kBallPartner) {
      apply_edge_event(m, event);
    } else if (window_.has_participant()) {
      worker_.conflicts.push_back({index_, memory_.ball_owner});
      return false;
    } else {
      apply_ball_hit(m, event, memory_.ball.trajectory);
      predict_changed(m);
    }
    return true;
  }

  // Returns whether the partner of m's event has left the trajectory that the event was predicted on. It does
  // not notify m. The true next event of m is not earlier: it would have replaced this one.
  bool is_stale(std::uint32_t m, std::uint32_t partner) {
    const Member& other = member(partner);
    if (!other.has_changed) return false;
    return is_retired(other.trajectory.anchor) ||
           !is_at_same_time(collision_of<kBoundary>(member(m), other), member(m).event);
  }

  static bool is_at_same_time(const Event& a, const Event& b) {
    return a.tick == b.tick && a.generation == b.generation;
  }

  void apply_pair_event(std::uint32_t one, std::uint32_t other, const Event& event) {
    const std::uint32_t tick = event.tick;
    const bool in_order = id(member(one).index) < id(member(other).index);
    const std::uint32_t a = in_order ? one : other, b = in_order ? other : one;
    Trajectory first = member(a).trajectory, second = member(b).trajectory;
    anchor_at<kBoundary>(c_, first, tick);
    anchor_at<kBoundary>(c_, second, tick);
    const bool elastic = is_in_contact(c_.plan, tick, member(a).last_contact_tick) ||
                         is_in_contact(c_.plan, tick, member(b).last_contact_tick);
    collide<kBoundary>(c_, first, second, elastic, cluster_.tally);
    set_trajectory(a, first, event);
    set_trajectory(b, second, event);
    member(a).last_contact_tick = member(b).last_contact_tick = c_.plan.start + tick;
    record_event(tick, id(member(a).index), id(member(b).index));
    window_.search.find_candidates_of_two(window_.space, {mover(a), mover(b)}, worker_.candidates);
    predict_changed(a, b, worker_.candidates[0]);
    predict_changed(b, a, worker_.candidates[1]);
  }

  void apply_edge_event(std::uint32_t m, const Event& event) {
    Trajectory now = member(m).trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    apply_edge(c_, event.partner, now);
    if (event.partner == kExit) cluster_.tally.retired();
    set_trajectory(m, now, event);
    member(m).last_contact_tick = c_.plan.start + event.tick;
    record_event(event.tick, id(member(m).index), event.partner);
    predict_changed(m);
  }

  BallReaction apply_ball_hit(std::uint32_t m, const Event& event, const BallTrajectory& trajectory) {
    Trajectory now = member(m).trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    const BallReaction reaction =
        collide_with_ball<kBoundary>(c_, trajectory, event.tick, now, cluster_.tally);
    set_trajectory(m, now, event);
    record_event(event.tick, id(member(m).index), kBallPartner);
    return reaction;
  }

  bool apply_ball_event() {
    const Event event = ball().event;
    BallReaction reaction{};
    std::uint32_t m = kInvalidIndex;
    if (is_parcel(event.partner)) {
      m = join(event.partner);
      if (m == kInvalidIndex) return false;
      if (is_ball_event_stale(member(m))) {
        predict_ball();
        return true;
      }
      reaction = apply_ball_hit(m, event, ball().now.trajectory);
    } else {
      record_event(event.tick, event.partner, kBallPartner);
    }
    set_ball_trajectory(event, reaction);
    if (m != kInvalidIndex) predict_changed(m);
    predict_ball();
    return true;
  }

  // ---- the ball as a member

  bool is_ball_event_stale(const Member& partner) {
    return is_retired(partner.trajectory.anchor) ||
           !is_at_same_time(ball_collision_with<kBoundary>(partner), ball().event);
  }

  void predict_ball() {
    Event best;
    const BallTrajectory& trajectory = ball().now.trajectory;
    for (const std::uint32_t i : parcels_on_path<kBoundary>()) {
      if (window_.owner_of(i) == index_ && member(memory_.member_slot[i]).has_changed) continue;
      const Trajectory parcel = window_.start_trajectory(i);
      if (is_retired(parcel.anchor)) continue;
      const std::uint32_t tick = window_.ball_tick<kBoundary>(trajectory, parcel);
      keep_earlier(best, {tick, i, id(i), ball_generation(tick)});
    }
    for (std::uint32_t m = cluster_.first_member; m < worker_.members.size(); ++m) {
      const Member& it = member(m);
      if (!it.has_changed || is_retired(it.trajectory.anchor) || !window_.is_near_ball<kBoundary>(it.index))
        continue;
      keep_earlier(best, ball_collision_with<kBoundary>(it));
    }
    Event edge;
    keep_ball_edge_event<kBoundary>(c_, trajectory, edge);
    edge.generation = ball_generation(edge.tick);
    if (edge.tick < window_.ball_end) keep_earlier(best, edge);
    set_ball_event(best);
  }

  // Updates the ball's event for a member on a new trajectory. If the event was with the old one, that is
  // found when it is due.
  void update_ball_event(const Member& changed) {
    if (is_retired(changed.trajectory.anchor) || !window_.is_near_ball<kBoundary>(changed.index)) return;
    const Event now = ball_collision_with<kBoundary>(changed);
    if (now.tick != kNoTick && comes_before(now, ball().event)) set_ball_event(now);
  }

  // ---- predictions

  Mover mover(std::uint32_t m) {
    return window_.make_mover<kBoundary>(member(m).index, member(m).trajectory);
  }

  void keep_edge_and_ball(const Member& it, Event& best) const {
    if (may_reach_edge<kBoundary>(c_, window_.input.position[it.index])) {
      Event edge;
      keep_edge_event<kBoundary>(c_, it.trajectory, edge);
      edge.generation = generation(it, edge.tick);
      keep_earlier(best, edge);
    }
    if (c_.plan.ball == BallRole::absent || cluster_.has_ball) return;
    if (!window_.is_near_ball<kBoundary>(it.index)) return;
    const std::uint32_t tick = window_.ball_tick<kBoundary>(memory_.ball.trajectory, it.trajectory);
    if (window_.has_participant() && tick >= window_.end) return;  // that is an event of the ball
    keep_earlier(best, {tick, kBallPartner, kBallPartner, generation(it, tick)});
  }

  void predict_changed(std::uint32_t m) {
    if (is_retired(member(m).trajectory.anchor)) {
      set_event(m, {});
      if (cluster_.has_ball) update_ball_event(member(m));
      return;
    }
    window_.find_candidates(mover(m), worker_.candidates[0]);
    predict_changed(m, kInvalidIndex, worker_.candidates[0]);
  }

  // Predicts the next event of a member on a new trajectory, and updates members that it collides with before
  // their own events. `partner` has changed as well and is predicted separately. Parcels whose event was with
  // the old trajectory find out when it is due. Parcels outside the cluster are updated at the commit.
  void predict_changed(std::uint32_t m, std::uint32_t partner, const Candidates& candidates) {
    const Member it = member(m);
    Event best;
    for (const std::uint32_t j : candidates.overlapping) {
      const std::uint32_t owner = window_.owner_of(j);
      if (owner == index_) {
        predict_between(it, j, partner, best);
        continue;
      }
      if (owner != kInvalidIndex) worker_.neighbour_pairs.push_back({it.index, j});
      const std::uint32_t tick = collision_tick<kBoundary>(c_, it.trajectory, window_.start_trajectory(j));
      if (tick == kNoTick) continue;
      keep_earlier(best, {tick, j, id(j), generation(it, tick)});
      if (memory_.calendar.would_lower(j, tick, it.index))
        worker_.notes.push_back({j, m, it.trajectory.tick, tick});
    }
    for (const std::uint32_t j : candidates.owned) {
      if (window_.owner_of(j) == index_)
        predict_between(it, j, partner, best);
      else
        worker_.neighbour_pairs.push_back({it.index, j});
    }
    keep_edge_and_ball(it, best);
    set_event(m, best);
    if (cluster_.has_ball) update_ball_event(it);
  }

  // Predicts the collision with parcel j, a member, for both.
  void predict_between(const Member& it, std::uint32_t j, std::uint32_t partner, Event& best) {
    const std::uint32_t n = memory_.member_slot[j];
    const Member& other = member(n);
    if (is_retired(other.trajectory.anchor)) return;
    const Event collision = collision_of<kBoundary>(it, other);
    keep_earlier(best, collision);
    const Event now{collision.tick, it.index, id(it.index), collision.generation};
    if (n != partner && now.tick != kNoTick && comes_before(now, other.event)) set_event(n, now);
  }

  // Predicts the next event of a member on its old trajectory.
  void repredict(std::uint32_t m) {
    const Member it = member(m);
    window_.find_candidates(mover(m), worker_.candidates[0]);
    Event best;
    const auto keep_collision = [&](const Member& other) {
      if (!is_retired(other.trajectory.anchor)) keep_earlier(best, collision_of<kBoundary>(it, other));
    };
    const auto note_other = [&](std::uint32_t j) {
      const std::uint32_t owner = window_.owner_of(j);
      if (owner != index_ && owner != kInvalidIndex) worker_.neighbour_pairs.push_back({it.index, j});
      return owner == index_;
    };
    for (const std::uint32_t j : worker_.candidates[0].overlapping) {
      if (note_other(j)) {
        keep_collision(member(memory_.member_slot[j]));
        continue;
      }
      const Trajectory other = window_.start_trajectory(j);  // not retired: those have no disc
      const std::uint32_t tick = collision_tick<kBoundary>(c_, it.trajectory, other);
      keep_earlier(best, {tick, j, id(j), generation(it, tick)});
    }
    for (const std::uint32_t j : worker_.candidates[0].owned) {
      if (note_other(j)) keep_collision(member(memory_.member_slot[j]));
    }
    keep_edge_and_ball(it, best);
    set_event(m, best);
  }
};

}  // namespace pf
