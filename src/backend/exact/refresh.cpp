#include "backend/exact/refresh.hpp"

#include "backend/exact/parallel_loops.hpp"
#include "backend/exact/predict.hpp"
#include "backend/exact/read_ahead.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

// With fewer groups than this in which something is due the calling thread lists it alone.
constexpr std::size_t kMinSharedGroups = 8;

void list_due(WindowContext& window) {
  EpochMemory& memory = window.memory;
  Calendar& calendar = memory.calendar;
  memory.due.clear();
  memory.due_groups.clear();
  calendar.list_due_groups(window.end, memory.due_groups);
  const std::size_t num_groups = memory.due_groups.size();
  if (num_groups < kMinSharedGroups) {
    for (const std::uint32_t group : memory.due_groups) calendar.take_due(group, window.end, memory.due);
    return;
  }
  window.team.run([&](unsigned thread) {
    const auto [first, last] = window.team.share(thread, num_groups);
    for (std::size_t k = first; k < last; ++k)
      calendar.take_due(memory.due_groups[k], window.end, memory.workers[thread].selected);
  });
  for (WorkerState& worker : memory.workers) {
    memory.due.insert(memory.due.end(), worker.selected.begin(), worker.selected.end());
    worker.selected.clear();
  }
}

// Returns whether a parcel of a due event has left the trajectory that it was predicted on.
template <Boundary kBoundary>
bool is_stale(const WindowContext& window, std::uint32_t i) {
  const Calendar& calendar = window.memory.calendar;
  const Event event = calendar.event(i);
  // A participating ball keeps its collisions itself. A parcel has one only where a window was cut before it.
  if (!is_parcel(event.partner)) return event.partner == kBallPartner && window.has_participant();
  // The partner would keep a collision that is to come, or an earlier event.
  if (calendar.tick(event.partner) > event.tick) return true;
  const Trajectory partner = window.start_trajectory(event.partner);
  return is_retired(partner.anchor) ||
         collision_tick<kBoundary>(window.c, window.start_trajectory(i), partner) != event.tick;
}

template <Boundary kBoundary>
void repredict(WindowContext& window, WorkerState& worker, std::uint32_t i) {
  const ExactConstants& c = window.c;
  const Trajectory trajectory = window.start_trajectory(i);
  Candidates& candidates = worker.candidates[0];
  window.find_candidates(window.make_mover<kBoundary>(i, trajectory), candidates);
  Event best;
  for (const std::uint32_t j : candidates.overlapping) {
    const std::uint32_t tick = collision_tick<kBoundary>(c, trajectory, window.start_trajectory(j));
    keep_earlier(best, {tick, j, window.trajectories.id[j]});
  }
  if (may_reach_edge<kBoundary>(c, window.input.position[i])) keep_edge_event<kBoundary>(c, trajectory, best);
  if (window.has_frozen_ball() && window.is_near_ball<kBoundary>(i)) {
    const std::uint32_t tick = window.ball_tick<kBoundary>(window.memory.ball.trajectory, trajectory);
    keep_earlier(best, {tick, kBallPartner, kBallPartner});
  }
  window.memory.calendar.set(i, best);
}

template <Boundary kBoundary>
void repredict_stale(WindowContext& window) {
  constexpr std::size_t kAhead = 8;  // parcels
  const std::vector<std::uint32_t>& due = window.memory.due;
  const ParcelArrays& parcels = window.trajectories;
  for_each_share(window, due.size(), [&](WorkerState& worker, std::size_t begin, std::size_t end) {
    ReadAhead ahead(window.space, due.size(), {parcels.tick.data()},
                    {parcels.position.data(), parcels.velocity.data(), window.memory.calendar.line(0)});
    for (std::size_t k = begin; k < end; ++k) {
      if (ahead.is_active() && k + kAhead < end) ahead.reach(due[k + kAhead]);
      if (is_stale<kBoundary>(window, due[k])) worker.stale.push_back(due[k]);
    }
  });
  for_each_worker(window, due.size(), [&](WorkerState& worker) {
    for (const std::uint32_t i : worker.stale) repredict<kBoundary>(window, worker, i);
    worker.stale.clear();
  });
}

template <Boundary kBoundary>
void refresh_ball(WindowContext& window) {
  EpochMemory& memory = window.memory;
  const Event& event = memory.ball_event;
  if (!window.has_participant() || event.tick >= window.end || !is_parcel(event.partner)) return;
  const Trajectory partner = window.start_trajectory(event.partner);
  if (!is_retired(partner.anchor) &&
      window.ball_tick<kBoundary>(memory.ball.trajectory, partner) == event.tick)
    return;
  memory.ball_event = next_ball_event<kBoundary>(window);
}

template <Boundary kBoundary>
void refresh(WindowContext& window) {
  EpochMemory& memory = window.memory;
  list_due(window);
  if (window.begin > 0) repredict_stale<kBoundary>(window);  // else all have just been predicted
  memory.active.clear();
  for (const std::uint32_t i : memory.due) {
    if (memory.calendar.tick(i) < window.end) memory.active.push_back(i);
  }
  refresh_ball<kBoundary>(window);
}

}  // namespace

void refresh(WindowContext& window) {
  for_boundary(window.c.run.physics.world.boundary,
               [&]<Boundary kBoundary>() { refresh<kBoundary>(window); });
}

}  // namespace pf
