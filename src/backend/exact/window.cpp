#include "backend/exact/window.hpp"

namespace pf {

void EpochMemory::prepare_epoch(unsigned num_threads, std::size_t num_parcels) {
  workers.resize(num_threads);
  discs.resize(num_parcels);
  const std::size_t num_owners = num_parcels + kSearchPadding;
  if (owner.size() != num_owners) owner.assign(num_owners, kInvalidIndex);
  member_slot.resize(num_parcels);
  chunk_speed2.resize((num_parcels + kChunkSize - 1) / kChunkSize);
}

void EpochMemory::prepare_window() {
  knows_on_path = false;
  for (WorkerState& worker : workers) {
    worker.tally = {};
    worker.members.clear();
    worker.segments.clear();
    worker.events.clear();
    worker.notes.clear();
    worker.compared_pairs.clear();
  }
}

std::uint64_t EpochMemory::memory_bytes() const {
  std::uint64_t bytes = 4 * (chunk_speed2.capacity() + owner.capacity() + member_slot.capacity() +
                             due_groups.capacity() + due.capacity() + active.capacity() +
                             near_ball.capacity() + on_path.capacity() + seeds.capacity() + todo.capacity()) +
                        sizeof(Cluster) * clusters.capacity() + discs.memory_bytes() +
                        calendar.memory_bytes();
  for (const WorkerState& worker : workers) {
    bytes += sizeof(Member) * worker.members.capacity() +
             sizeof(TrajectorySegment) * worker.segments.capacity() +
             sizeof(NeighbourNote) * worker.notes.capacity() +
             sizeof(IndexPair) * (worker.neighbour_pairs.capacity() + worker.compared_pairs.capacity()) +
             4 * (worker.selected.capacity() + worker.stale.capacity());
  }
  return bytes;
}

}  // namespace pf
