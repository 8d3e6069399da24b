// Method `exact` on the CPU: the members of a cluster while it is solved, the ball among them, and the queue
// of their events.
#pragma once

#include <algorithm>

#include "backend/exact/window.hpp"

namespace pf {

class ClusterMembers {
 protected:
  ClusterMembers(WindowContext& window, std::uint32_t thread, std::uint32_t index)
      : window_(window),
        c_(window.c),
        memory_(window.memory),
        worker_(window.memory.workers[thread]),
        index_(index),
        cluster_(window.memory.clusters[index]) {}

  static constexpr std::uint32_t kBallMember = 0xFFFFFFFEU;

  // m: a slot among the worker's members. i, j: indices of parcels.
  Member& member(std::uint32_t m) { return worker_.members[m]; }
  std::uint32_t id(std::uint32_t i) const { return window_.trajectories.id[i]; }
  BallMember& ball() { return memory_.solved_ball; }

  std::uint32_t add_member(std::uint32_t i) {
    const auto m = static_cast<std::uint32_t>(worker_.members.size());
    Member added;
    added.index = i;
    added.trajectory = window_.start_trajectory(i);
    added.event = memory_.calendar.event(i);
    const std::vector<std::uint32_t>& last_contact_tick = window_.trajectories.last_contact_tick;
    added.last_contact_tick = last_contact_tick.empty() ? 0U : last_contact_tick[i];
    worker_.members.push_back(added);
    memory_.member_slot[i] = m;
    return m;
  }

  // Returns the parcel's slot among the members; a free parcel becomes one. Returns kInvalidIndex and records
  // a conflict if another cluster owns it.
  std::uint32_t join(std::uint32_t i) {
    if (window_.owner_of(i) == index_) return memory_.member_slot[i];
    const std::uint32_t owner = window_.claim(i, index_);
    if (owner == index_) return add_member(i);
    worker_.conflicts.push_back({index_, owner});
    return kInvalidIndex;
  }

  // ---- generations of events

  std::uint32_t generation(const Member& it, std::uint32_t tick) const {
    return generation_at(tick, anchor_time(c_.plan, it.trajectory), it.next_generation);
  }
  std::uint32_t ball_generation(std::uint32_t tick) {
    return generation_at(tick, ball().now.trajectory.tick, ball().next_generation);
  }

  // Their collision, as the first one sees it.
  template <Boundary kBoundary>
  Event collision_of(const Member& it, const Member& other) const {
    const std::uint32_t tick = collision_tick<kBoundary>(c_, it.trajectory, other.trajectory);
    return {tick, other.index, id(other.index), std::max(generation(it, tick), generation(other, tick))};
  }

  // The ball's collision with a member.
  template <Boundary kBoundary>
  Event ball_collision_with(const Member& it) {
    const std::uint32_t tick = window_.ball_tick<kBoundary>(ball().now.trajectory, it.trajectory);
    return {tick, it.index, id(it.index), std::max(ball_generation(tick), generation(it, tick))};
  }

  // ---- the queue

  void push(std::uint32_t m) {
    const Member& it = member(m);
    if (it.event.tick < window_.end) worker_.queue.push(m, it.version, id(it.index), it.event);
  }

  void set_event(std::uint32_t m, const Event& event) {
    ++member(m).version;
    member(m).event = event;
    push(m);
  }

  void push_ball() {
    if (ball().event.tick < window_.end)
      worker_.queue.push(kBallMember, ball().version, kBallPartner, ball().event);
  }

  void set_ball_event(const Event& event) {
    ++ball().version;
    ball().event = event;
    push_ball();
  }

  // ---- events

  void record_event(std::uint32_t tick, std::uint32_t first, std::uint32_t second) {
    const std::uint64_t at =
        window_.input.start_tick + (static_cast<std::uint64_t>(tick) << window_.input.tick_exponent);
    const std::uint32_t low = std::min(first, second), high = std::max(first, second);
    cluster_.event_hash += event_hash(at, low, high);
    cluster_.last_tick = tick;
    ++cluster_.num_events;
    if (window_.records_events) worker_.events.push_back({at, low, high});
  }

  void set_trajectory(std::uint32_t m, const Trajectory& trajectory, const Event& event) {
    Member& it = member(m);
    if (it.has_changed) {
      worker_.segments.push_back({it.trajectory, event.tick, it.last_segment});
      it.last_segment = static_cast<std::uint32_t>(worker_.segments.size()) - 1;
    }
    const float speed2 = dot(trajectory.velocity, trajectory.velocity);
    it.trajectory = trajectory;
    it.next_generation = event.generation + 1;
    it.has_changed = true;
    cluster_.fastest2 = std::max(cluster_.fastest2, static_cast<double>(speed2));
  }

  // ---- the ball as a member

  void add_ball() {
    BallMember& it = ball();
    it.now = memory_.ball;
    it.event = memory_.ball_event;
    it.version = 0;
    it.next_generation = 0;
    it.has_changed = it.is_bent = false;
    it.fastest_mps = 0.0;
    it.segments.clear();
    push_ball();
  }

  void set_ball_trajectory(const Event& event, const BallReaction& reaction) {
    BallMember& it = ball();
    if (it.has_changed) it.segments.push_back({it.now.trajectory, event.tick});
    apply_to_ball(c_, event.tick, event.partner, reaction, it.now);
    it.next_generation = event.generation + 1;
    it.has_changed = true;
    it.is_bent = it.is_bent || !stays_near_path(it.now.trajectory);
    it.fastest_mps = std::max(it.fastest_mps, surface_speed_mps(c_.run.physics, it.now.trajectory));
    it.event = {};
  }

  // Parcels that may hit the ball on their start trajectories.
  template <Boundary kBoundary>
  const std::vector<std::uint32_t>& parcels_on_path() {
    if (ball().is_bent) return memory_.near_ball;
    if (memory_.knows_on_path) return memory_.on_path;
    memory_.on_path.clear();
    for (const std::uint32_t i : memory_.near_ball) {
      const Trajectory parcel = window_.start_trajectory(i);
      if (!is_retired(parcel.anchor) && comes_near_path<kBoundary>(parcel)) memory_.on_path.push_back(i);
    }
    memory_.knows_on_path = true;
    return memory_.on_path;
  }

  WindowContext& window_;
  const ExactConstants& c_;
  EpochMemory& memory_;
  WorkerState& worker_;
  std::uint32_t index_;
  Cluster& cluster_;

 private:
  // Width of what counts as near the path that the ball has if nothing hits it, position units. The ball
  // itself may leave it by half of that; the rest is above all roundings.
  double path_margin() const { return 0.02 * c_.run.contact_distance + 64.0; }

  // Returns whether the ball stays near that path until the epoch ends, on a trajectory that began in the
  // window.
  bool stays_near_path(const BallTrajectory& now) const {
    const Vec2d bend = now.velocity_mps - memory_.ball.trajectory.velocity_mps;
    return bend_units(c_.plan, bend, window_.begin) < 0.5 * path_margin();
  }

  template <Boundary kBoundary>
  bool comes_near_path(const Trajectory& parcel) const {
    const double near = c_.run.ball_contact + path_margin();
    return tick_near_ball<kBoundary>(c_, memory_.ball.trajectory, parcel, near) != kNoTick;
  }
};

}  // namespace pf
