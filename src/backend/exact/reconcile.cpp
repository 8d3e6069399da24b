#include "backend/exact/reconcile.hpp"

#include <algorithm>
#include <numeric>

#include "backend/exact/clusters.hpp"
#include "backend/exact/parallel_loops.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

// Calls visit(trajectory, end) for the trajectories that events of the window led a parcel to, latest first,
// until it returns true. Returns whether it did. end: tick of the window.
template <class Visit>
bool any_segment(const WindowContext& window, std::uint32_t i, const Visit& visit) {
  const EpochMemory& memory = window.memory;
  const WorkerState& worker = memory.workers[memory.clusters[memory.owner[i]].thread];
  const Member& member = worker.members[memory.member_slot[i]];
  if (!member.has_changed) return false;
  if (!is_retired(member.trajectory.anchor) && visit(member.trajectory, window.end - 1)) return true;
  for (std::uint32_t s = member.last_segment; s != kInvalidIndex; s = worker.segments[s].previous) {
    if (visit(worker.segments[s].trajectory, worker.segments[s].end)) return true;
  }
  return false;
}

// The same for the ball.
template <class Visit>
bool any_ball_segment(const WindowContext& window, const Visit& visit) {
  const BallMember& ball = window.memory.solved_ball;
  if (visit(ball.now.trajectory, window.end - 1)) return true;
  return std::any_of(ball.segments.begin(), ball.segments.end(), [&](const BallTrajectorySegment& segment) {
    return visit(segment.trajectory, segment.end);
  });
}

// Whether a collision happens while both bodies are on their trajectories.
bool happens_before(std::uint32_t tick, std::uint32_t first_end, std::uint32_t second_end) {
  return tick != kNoTick && tick <= std::min(first_end, second_end);
}

template <Boundary kBoundary>
bool trajectories_collide(const WindowContext& window, std::uint32_t i, std::uint32_t j) {
  return any_segment(window, i, [&](const Trajectory& a, std::uint32_t a_end) {
    return any_segment(window, j, [&](const Trajectory& b, std::uint32_t b_end) {
      return happens_before(collision_tick<kBoundary>(window.c, a, b), a_end, b_end);
    });
  });
}

template <Boundary kBoundary>
bool collides_with_ball(const WindowContext& window, std::uint32_t i) {
  return any_segment(window, i, [&](const Trajectory& parcel, std::uint32_t parcel_end) {
    return any_ball_segment(window, [&](const BallTrajectory& ball, std::uint32_t ball_end) {
      return happens_before(ball_collision_tick<kBoundary>(window.c, ball, parcel), parcel_end, ball_end);
    });
  });
}

template <Boundary kBoundary>
void find_parcel_conflicts(WindowContext& window) {
  const EpochMemory& memory = window.memory;
  std::size_t num_pairs = 0;
  for (const WorkerState& worker : memory.workers) num_pairs += worker.neighbour_pairs.size();
  for_each_worker(window, num_pairs, [&](WorkerState& worker) {
    for (const auto& [i, j] : worker.neighbour_pairs) {
      const std::uint32_t a = memory.owner[i], b = memory.owner[j];
      if (a != b && memory.clusters[b].is_solved && trajectories_collide<kBoundary>(window, i, j))
        worker.conflicts.push_back({a, b});
    }
    worker.compared_pairs.insert(worker.compared_pairs.end(), worker.neighbour_pairs.begin(),
                                 worker.neighbour_pairs.end());
    worker.neighbour_pairs.clear();
  });
}

template <Boundary kBoundary>
void find_ball_conflicts(WindowContext& window) {
  const EpochMemory& memory = window.memory;
  const std::uint32_t ball_owner = memory.ball_owner;
  if (ball_owner == kInvalidIndex || !memory.solved_ball.has_changed || !memory.clusters[ball_owner].is_solved)
    return;
  for_each_item(window, memory.near_ball.size(), [&](WorkerState& worker, std::size_t k) {
    const std::uint32_t i = memory.near_ball[k], owner = memory.owner[i];
    if (owner == kInvalidIndex || owner == ball_owner || !memory.clusters[owner].is_solved) return;
    if (collides_with_ball<kBoundary>(window, i)) worker.conflicts.push_back({ball_owner, owner});
  });
}

// Joins the clusters of every conflict in the trees of `parent`. Returns these clusters in ascending order.
std::vector<std::uint32_t> union_conflicting(EpochMemory& memory, std::vector<std::uint32_t>& parent) {
  std::vector<std::uint32_t> involved;
  for (WorkerState& worker : memory.workers) {
    for (const auto& [a, b] : worker.conflicts) {
      union_sets(parent, a, b);
      involved.push_back(a);
      involved.push_back(b);
    }
    worker.conflicts.clear();
  }
  std::sort(involved.begin(), involved.end());
  involved.erase(std::unique(involved.begin(), involved.end()), involved.end());
  return involved;
}

// Moves the members of cluster k to its representative, as seeds. Called for the clusters of a set in
// ascending order, so that the representative comes first.
void reassign_members(EpochMemory& memory, std::uint32_t representative, std::uint32_t k) {
  Cluster& into = memory.clusters[representative];
  Cluster& from = memory.clusters[k];
  const WorkerState& worker = memory.workers[from.thread];
  if (representative == k) {
    memory.todo.push_back(representative);
    into.first_seed = static_cast<std::uint32_t>(memory.seeds.size());
    into.num_seeds = 0;
  }
  for (std::uint32_t m = from.first_member; m < from.first_member + from.num_members; ++m) {
    const std::uint32_t i = worker.members[m].index;
    memory.owner[i] = representative;
    memory.seeds.push_back(i);
    ++into.num_seeds;
  }
  if (representative == k) return;
  if (from.has_ball) {
    into.has_ball = true;
    memory.ball_owner = representative;
  }
  from.is_merged = true;
}

bool has_conflicts(const EpochMemory& memory) {
  return std::any_of(memory.workers.begin(), memory.workers.end(),
                     [](const WorkerState& worker) { return !worker.conflicts.empty(); });
}

}  // namespace

void find_conflicts(WindowContext& window) {
  for_boundary(window.c.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    find_parcel_conflicts<kBoundary>(window);
    find_ball_conflicts<kBoundary>(window);
  });
}

void merge(WindowContext& window) {
  EpochMemory& memory = window.memory;
  if (!has_conflicts(memory)) return memory.todo.clear();
  std::vector<std::uint32_t>& parent = memory.todo;  // has no other use at the moment
  parent.resize(memory.clusters.size());
  std::iota(parent.begin(), parent.end(), 0U);
  struct Reassignment {
    std::uint32_t representative, cluster;
    auto operator<=>(const Reassignment&) const = default;
  };
  std::vector<Reassignment> order;
  for (const std::uint32_t k : union_conflicting(memory, parent)) order.push_back({find_root(parent, k), k});
  std::sort(order.begin(), order.end());
  memory.todo.clear();
  for (const auto& [representative, k] : order) reassign_members(memory, representative, k);
}

}  // namespace pf
