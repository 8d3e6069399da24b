#include "backend/exact/commit.hpp"

#include "backend/exact/parallel_loops.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

// Calls visit(worker, cluster, members) for all clusters of the solution.
template <class Visit>
void for_each_cluster(WindowContext& window, const Visit& visit) {
  const EpochMemory& memory = window.memory;
  for_each_item_by_any(window, memory.clusters.size(), kMinSharedItems, kMinSharedItems / 2,
                       [&](WorkerState& worker, std::size_t k) {
                         const Cluster& cluster = memory.clusters[k];
                         if (cluster.is_merged) return;
                         visit(worker, cluster,
                               memory.workers[cluster.thread].members.data() + cluster.first_member);
                       });
}

template <Boundary kBoundary>
void store(WindowContext& window, const Member& member) {
  const std::uint32_t i = member.index;
  window.memory.calendar.set(i, member.event);
  if (!member.has_changed) return;
  ParcelArrays& parcels = window.trajectories;
  parcels.position[i] = member.trajectory.anchor;
  parcels.velocity[i] = member.trajectory.velocity;
  parcels.tick[i] = member.trajectory.tick;
  if (!parcels.last_contact_tick.empty()) parcels.last_contact_tick[i] = member.last_contact_tick;
  window.memory.discs.set(i, window.make_mover<kBoundary>(i, member.trajectory).disc);
}

// Stores what belongs to the members themselves.
template <Boundary kBoundary>
void store_members(WindowContext& window) {
  for_each_cluster(window, [&](WorkerState& worker, const Cluster& cluster, const Member* members) {
    for (std::uint32_t m = 0; m < cluster.num_members; ++m) store<kBoundary>(window, members[m]);
    cluster.tally.add_to(worker.tally);
  });
  EpochMemory& memory = window.memory;
  if (!window.has_participant()) return;
  memory.ball = memory.solved_ball.now;
  memory.ball_event = memory.solved_ball.event;
}

// Parcels outside a cluster that will collide with its members earlier than they knew. If the neighbour has
// changed since then, too, the note is stale, and does no harm.
void apply_notes(WindowContext& window, const Cluster& cluster) {
  EpochMemory& memory = window.memory;
  const WorkerState& solver = memory.workers[cluster.thread];
  for (std::uint32_t k = cluster.first_note; k < cluster.first_note + cluster.num_notes; ++k) {
    const NeighbourNote& note = solver.notes[k];
    const Member& member = solver.members[note.member];
    if (member.trajectory.tick == note.anchor_tick)
      memory.calendar.lower(note.neighbour, note.tick, member.index);
  }
}

// The ball's next event, for members of clusters without it.
template <Boundary kBoundary>
void update_ball_event(const WindowContext& window, const Member& member, Event& earliest) {
  if (!member.has_changed || is_retired(member.trajectory.anchor)) return;
  if (!window.is_near_ball<kBoundary>(member.index)) return;
  const std::uint32_t tick = window.ball_tick<kBoundary>(window.memory.ball.trajectory, member.trajectory);
  keep_earlier(earliest, {tick, member.index, window.trajectories.id[member.index]});
}

template <Boundary kBoundary>
void update_pair(WindowContext& window, std::uint32_t i, std::uint32_t j) {
  const Trajectory a = window.start_trajectory(i), b = window.start_trajectory(j);
  if (is_retired(a.anchor) || is_retired(b.anchor)) return;
  const std::uint32_t tick = collision_tick<kBoundary>(window.c, a, b);
  if (tick == kNoTick) return;
  window.memory.calendar.lower(i, tick, j);
  window.memory.calendar.lower(j, tick, i);
}

// Updates the kept events of parcels that a new trajectory of another cluster concerns.
template <Boundary kBoundary>
void update_neighbours(WindowContext& window) {
  EpochMemory& memory = window.memory;
  for_each_cluster(window, [&](WorkerState& worker, const Cluster& cluster, const Member* members) {
    apply_notes(window, cluster);
    const bool ball_is_elsewhere = window.has_participant() && !cluster.has_ball;
    for (std::uint32_t m = 0; ball_is_elsewhere && m < cluster.num_members; ++m)
      update_ball_event<kBoundary>(window, members[m], worker.ball_event);
  });
  std::size_t num_pairs = 0;
  for (const WorkerState& worker : memory.workers) num_pairs += worker.compared_pairs.size();
  for_each_worker(window, num_pairs, [&](WorkerState& worker) {
    for (const auto& [i, j] : worker.compared_pairs) update_pair<kBoundary>(window, i, j);
  });
  for (WorkerState& worker : memory.workers) {
    keep_earlier(memory.ball_event, worker.ball_event);
    worker.ball_event = {};
  }
}

void release_members(WindowContext& window) {
  for_each_cluster(window, [&](WorkerState&, const Cluster& cluster, const Member* members) {
    for (std::uint32_t m = 0; m < cluster.num_members; ++m)
      window.memory.owner[members[m].index] = kInvalidIndex;
  });
}

}  // namespace

void commit(WindowContext& window) {
  for_boundary(window.c.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    store_members<kBoundary>(window);
    update_neighbours<kBoundary>(window);
  });
  release_members(window);
}

void discard(WindowContext& window) {
  release_members(window);
  for (const std::uint32_t i : window.memory.due) window.memory.calendar.restore(i);
}

}  // namespace pf
