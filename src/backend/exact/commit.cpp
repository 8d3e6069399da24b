#include "backend/exact/commit.hpp"

#include "backend/exact/parallel_loops.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

template <Boundary kBoundary>
void store(StepContext& step, const Member& member) {
  if (!member.has_changed) return;
  ParcelArrays& parcels = step.trajectories;
  const std::uint32_t i = member.index;
  parcels.position[i] = member.trajectory.anchor;
  parcels.velocity[i] = member.trajectory.velocity;
  parcels.tick[i] = member.trajectory.tick;
  if (!parcels.last_contact_tick.empty()) parcels.last_contact_tick[i] = member.last_contact_tick;
  step.end_position[i] =
      position_at<kBoundary>(step.c, member.trajectory, static_cast<std::int32_t>(step.c.plan.length));
}

// Leaves no trace of the step in the arrays that must be empty between steps.
void release(StepMemory& memory, const Member& member) {
  memory.owner[member.index] = kInvalidIndex;
  memory.event_key[member.index] = kNoEvent;
}

// Calls visit(member) for the members of all clusters, and finish(worker, cluster) after those of each.
template <class Visit, class Finish>
void for_each_member(StepContext& step, const Visit& visit, const Finish& finish) {
  const StepMemory& memory = step.memory;
  for_each_item(step, memory.clusters.size(), [&](WorkerState& worker, std::size_t k) {
    const Cluster& cluster = memory.clusters[k];
    if (cluster.is_merged) return;
    const Member* members = memory.workers[cluster.thread].members.data() + cluster.first_member;
    for (std::uint32_t m = 0; m < cluster.num_members; ++m) visit(members[m]);
    finish(worker, cluster);
  });
}

template <Boundary kBoundary>
void commit(StepContext& step) {
  const auto release_and_store = [&](const Member& member) {
    release(step.memory, member);
    store<kBoundary>(step, member);
  };
  for_each_member(step, release_and_store,
                  [](WorkerState& worker, const Cluster& cluster) { cluster.tally.add_to(worker.tally); });
}

}  // namespace

void commit(StepContext& step) {
  for_boundary(step.c.run.physics.world.boundary, [&]<Boundary kBoundary>() { commit<kBoundary>(step); });
}

void discard(StepContext& step) {
  for_each_member(
      step, [&](const Member& member) { release(step.memory, member); },
      [](const WorkerState&, const Cluster&) {});
}

}  // namespace pf
