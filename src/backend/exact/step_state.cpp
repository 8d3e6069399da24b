#include "backend/exact/step_state.hpp"

namespace pf {

void StepMemory::prepare(unsigned num_threads, std::size_t num_parcels) {
  workers.resize(num_threads);
  for (WorkerState& worker : workers) {
    worker.tally = {};
    worker.members.clear();
    worker.segments.clear();
    worker.events.clear();
  }
  discs.resize(num_parcels);
  if (event_key.size() != num_parcels) event_key.assign(num_parcels, kNoEvent);
  event_partner.resize(num_parcels);
  const std::size_t num_owners = num_parcels + kSearchPadding;
  if (owner.size() != num_owners) owner.assign(num_owners, kInvalidIndex);
  member_slot.resize(num_parcels);
}

std::uint64_t StepMemory::memory_bytes() const {
  std::uint64_t bytes = 8 * event_key.capacity() +
                        4 * (event_partner.capacity() + owner.capacity() + member_slot.capacity() +
                             active.capacity() + near_ball.capacity() + seeds.capacity() + todo.capacity()) +
                        sizeof(Cluster) * clusters.capacity() + discs.memory_bytes();
  for (const WorkerState& worker : workers)
    bytes +=
        sizeof(Member) * worker.members.capacity() + sizeof(TrajectorySegment) * worker.segments.capacity();
  return bytes;
}

DiscSpace make_disc_space(const StepInput& input, const StepMemory& memory, std::size_t num_parcels) {
  DiscSpace space;
  space.x = memory.discs.x.data();
  space.y = memory.discs.y.data();
  space.radius = memory.discs.radius.data();
  space.owner = memory.owner.data();
  space.cell_start = input.cell_start;
  space.grid = input.grid;
  space.num_parcels = static_cast<std::uint32_t>(num_parcels);
  space.all_pairs = input.all_pairs;
  set_reaches(input.constants, input.fastest_mps, input.max_displacement, space);
  return space;
}

}  // namespace pf
