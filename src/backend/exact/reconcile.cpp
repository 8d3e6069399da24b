#include "backend/exact/reconcile.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "backend/exact/clusters.hpp"
#include "backend/exact/parallel_loops.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

// The trajectories that events of the window led a parcel to, latest first.
class SegmentCursor {
 public:
  SegmentCursor(const WindowContext& window, std::uint32_t i)
      : worker_(&window.memory.workers[window.memory.clusters[window.memory.owner[i]].thread]) {
    const Member& member = worker_->members[window.memory.member_slot[i]];
    if (!member.has_changed) return;
    current_ = &member.trajectory;
    end_ = window.end - 1;
    next_ = member.last_segment;
    if (is_retired(current_->anchor)) advance();
  }

  bool is_valid() const { return current_ != nullptr; }
  const Trajectory& trajectory() const { return *current_; }
  std::uint32_t begin(const WindowContext& window) const {
    return static_cast<std::uint32_t>(anchor_time(window.c.plan, *current_));
  }
  std::uint32_t end() const { return end_; }  // tick

  void advance() {
    current_ = nullptr;
    if (next_ == kInvalidIndex) return;
    const TrajectorySegment& segment = worker_->segments[next_];
    current_ = &segment.trajectory;
    end_ = segment.end;
    next_ = segment.previous;
  }

 private:
  const WorkerState* worker_;
  const Trajectory* current_ = nullptr;  // null: there are no more
  std::uint32_t end_ = 0;
  std::uint32_t next_ = kInvalidIndex;
};

// Only trajectories that last at a common tick are compared.
template <Boundary kBoundary>
bool trajectories_collide(const WindowContext& window, std::uint32_t i, std::uint32_t j) {
  SegmentCursor latest_b(window, j);  // of those that begin before a's end
  for (SegmentCursor a(window, i); a.is_valid(); a.advance()) {
    while (latest_b.is_valid() && latest_b.begin(window) > a.end()) latest_b.advance();
    for (SegmentCursor b = latest_b; b.is_valid() && b.end() >= a.begin(window); b.advance()) {
      const std::uint32_t tick = collision_tick<kBoundary>(window.c, a.trajectory(), b.trajectory());
      if (happens_on_both(tick, a.end(), b.end())) return true;
    }
  }
  return false;
}

template <Boundary kBoundary>
bool collides_with_ball(const WindowContext& window, const BallTrajectory& ball, std::uint32_t ball_end,
                        std::uint32_t i) {
  for (SegmentCursor a(window, i); a.is_valid(); a.advance()) {
    if (ball.tick > static_cast<std::int32_t>(a.end()) || ball_end < a.begin(window)) continue;
    if (happens_on_both(window.ball_tick<kBoundary>(ball, a.trajectory()), a.end(), ball_end)) return true;
  }
  return false;
}

template <Boundary kBoundary>
bool collides_with_ball(const WindowContext& window, std::uint32_t i) {
  const BallMember& ball = window.memory.solved_ball;
  return collides_with_ball<kBoundary>(window, ball.now.trajectory, window.end - 1, i) ||
         std::any_of(ball.segments.begin(), ball.segments.end(), [&](const BallTrajectorySegment& segment) {
           return collides_with_ball<kBoundary>(window, segment.trajectory, segment.end, i);
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
  if (ball_owner == kInvalidIndex || !memory.solved_ball.has_changed ||
      !memory.clusters[ball_owner].is_solved)
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

bool cut(WindowContext& window) {
  EpochMemory& memory = window.memory;
  std::uint32_t end = window.end;
  for (const Cluster& cluster : memory.clusters) {
    if (cluster.is_merged) continue;
    if (cluster.has_failed) return false;  // the window will be discarded
    end = std::min(end, cluster.stopped_at);
  }
  if (end == window.end) return false;
  window.end = end;
  memory.todo.clear();
  for (std::uint32_t k = 0; k < memory.clusters.size(); ++k) {
    const Cluster& cluster = memory.clusters[k];
    if (!cluster.is_merged && cluster.is_solved && cluster.last_tick >= end) reassign_members(memory, k, k);
  }
  return true;
}

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
  };
  std::vector<Reassignment> order;
  for (const std::uint32_t k : union_conflicting(memory, parent)) order.push_back({find_root(parent, k), k});
  std::sort(order.begin(), order.end(), [](const Reassignment& a, const Reassignment& b) {
    return std::tie(a.representative, a.cluster) < std::tie(b.representative, b.cluster);
  });
  memory.todo.clear();
  for (const auto& [representative, k] : order) reassign_members(memory, representative, k);
}

}  // namespace pf
