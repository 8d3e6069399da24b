#include "cuda/exact/memory.cuh"

#include "cuda/check.cuh"
#include "cuda/exact/region_grid.hpp"

namespace pf::cuda {
namespace {

// Room in each slice: for one in this many of its parcels, and a margin for small scenes.
constexpr std::uint32_t kActiveShare = 4;         // have an event in the step
constexpr std::uint32_t kJoinedShare = 48;        // have none at first, but are hit
constexpr std::uint32_t kSegmentShare = 16;       // segments, between two events of a parcel in one step
constexpr std::uint32_t kNeighbourPairShare = 8;  // neighbours in two clusters
// Room in common lists.
constexpr std::uint32_t kCommonShare = 16;
constexpr std::uint32_t kNearBallShare = 16;
static_assert(kCommonShare <= kNearBallShare);  // see reassign_members()
constexpr std::uint32_t kMinCommon = 16384;
constexpr std::uint32_t kMaxBallHits = 16384;  // of all solutions of a window

CommonList list(const DeviceBuffer<std::uint32_t>& buffer) {
  return {buffer.data(), static_cast<std::uint32_t>(buffer.capacity())};
}

}  // namespace

void ExactMemory::choose_capacities(std::uint32_t num_parcels) {
  num_slices_ = exact_num_slices(num_parcels, has_ball_);
  const std::uint32_t in_slice = num_parcels / num_slices_;
  // Few parcels may all be in one crowd, each with many events in a tick; they cost little memory.
  const std::uint32_t more = num_slices_ <= 4 ? 8192 : (in_slice < 4096 ? 512 : 64);
  active_capacity_ = in_slice / kActiveShare + more;
  member_capacity_ = active_capacity_ + in_slice / kJoinedShare + more;
  segment_capacity_ = in_slice / kSegmentShare + 4 * more;
  neighbour_pair_capacity_ = in_slice / kNeighbourPairShare + 8 * more;
}

void ExactMemory::reserve(std::uint32_t num_parcels, bool has_ball) {
  if (is_for(num_parcels, has_ball)) return;
  DeviceBuffer<ExactState> state = std::move(state_);
  *this = ExactMemory();  // frees the old lists before the new ones are allocated
  state_ = std::move(state);
  has_ball_ = has_ball;
  choose_capacities(num_parcels);
  const auto all = [&](std::uint32_t capacity) { return static_cast<std::size_t>(capacity) * num_slices_; };
  const std::size_t common = num_parcels / kCommonShare + kMinCommon;
  earliest_ = DeviceBuffer<std::uint32_t>(num_parcels / kTile + 1);
  active_ = DeviceBuffer<std::uint32_t>(all(active_capacity_));
  counts_ = DeviceBuffer<SliceCounts>(num_slices_);
  representatives_ = DeviceBuffer<std::uint32_t>(all(active_capacity_));
  members_ = DeviceBuffer<Member>(all(member_capacity_));
  clusters_ = DeviceBuffer<Cluster>(all(member_capacity_));
  segments_ = DeviceBuffer<TrajectorySegment>(all(segment_capacity_));
  neighbour_pairs_ = DeviceBuffer<uint2>(all(neighbour_pair_capacity_));
  near_ball_ = DeviceBuffer<std::uint32_t>(num_parcels / kNearBallShare + kMinCommon);
  todo_ = DeviceBuffer<std::uint32_t>(common);
  conflicts_ = DeviceBuffer<uint2>(common);
  ball_segments_ = DeviceBuffer<BallSegment>(2 * kMaxBallSegments);
  segment_causes_ = DeviceBuffer<SegmentCause>(2 * kMaxBallSegments);
  ball_hits_ = DeviceBuffer<BallHit>(kMaxBallHits);
  reserved_ = num_parcels;
}

std::uint32_t* ExactMemory::start_regions(const GridShape& grid, cudaStream_t stream) {
  const std::size_t num = num_regions(grid);
  if (num > region_speed2_.capacity()) region_speed2_ = DeviceBuffer<std::uint32_t>(num);
  PF_CUDA(cudaMemsetAsync(region_speed2_.data(), 0, num * sizeof(std::uint32_t), stream));
  return region_speed2_.data();
}

std::size_t ExactMemory::bytes() const {
  return earliest_.bytes() + region_speed2_.bytes() + active_.bytes() + counts_.bytes() +
         representatives_.bytes() + members_.bytes() + clusters_.bytes() + segments_.bytes() +
         neighbour_pairs_.bytes() + near_ball_.bytes() + todo_.bytes() + conflicts_.bytes() +
         ball_segments_.bytes() + segment_causes_.bytes() + ball_hits_.bytes();
}

Vec2i* ExactMemory::positions(const DeviceParcels& next, std::uint32_t buffer) {
  static_assert(sizeof(Vec2i) == sizeof(Vec2f));
  return buffer == 0 ? next.position.data() : reinterpret_cast<Vec2i*>(next.velocity.data());
}

StepMemory ExactMemory::lay_out(const DeviceParcels& current, const DeviceParcels& next,
                                const DeviceCellSort& cell_sort) const {
  StepMemory m;
  m.trajectories = current.pointers();
  m.positions[0] = positions(next, 0);
  m.positions[1] = positions(next, 1);
  m.member_slot = next.id.data();
  m.list_head = next.tick.data();
  const SortScratch scratch = cell_sort.scratch();
  static_assert(sizeof(EventKey) == sizeof(*scratch.keys));
  m.events = reinterpret_cast<EventKey*>(scratch.keys);
  m.earliest = earliest_.data();
  m.owner = scratch.counts;
  m.active = {active_.data(), active_capacity_};
  m.num_slices = num_slices_;
  m.members = members_.data();
  m.clusters = clusters_.data();
  m.segments = segments_.data();
  m.neighbour_pairs = neighbour_pairs_.data();
  m.counts = counts_.data();
  m.member_capacity = member_capacity_;
  m.segment_capacity = segment_capacity_;
  m.neighbour_pair_capacity = neighbour_pair_capacity_;
  m.representatives = list(representatives_);
  m.near_ball = list(near_ball_);
  m.todo = list(todo_);
  m.conflicts = conflicts_.data();
  m.conflict_capacity = static_cast<std::uint32_t>(conflicts_.capacity());
  m.ball_paths[0] = ball_segments_.data();
  m.ball_paths[1] = ball_segments_.data() + kMaxBallSegments;
  m.segment_causes[0] = segment_causes_.data();
  m.segment_causes[1] = segment_causes_.data() + kMaxBallSegments;
  m.ball_hits = ball_hits_.data();
  m.ball_hit_capacity = kMaxBallHits;
  return m;
}

}  // namespace pf::cuda
