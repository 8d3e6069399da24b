#include "cuda/exact/memory.cuh"

#include <cmath>

#include "backend/exact/limits.hpp"

namespace pf {
namespace {

// Room in each segment: for one in so many of its parcels, and some more where parcels are few.
constexpr std::uint32_t kActiveShare = 4;    // have an event in the step
constexpr std::uint32_t kJoinedShare = 32;   // have none, but are hit
constexpr std::uint32_t kSegmentShare = 16;  // lines between two events of one step
constexpr std::uint32_t kNeighbourPairShare = 8;    // neighbours in two clusters
// Of the whole.
constexpr std::uint32_t kCommonShare = 16;
constexpr std::uint32_t kNearBallShare = 4;
constexpr std::uint32_t kMinCommon = 16384;
constexpr std::uint32_t kMaxBallSegments = 4096;

}  // namespace

void ExactMemory::reset_time() {
  is_active_ = false;
  time_s_ = 0.0;
  now_ = 0;
}

void ExactMemory::reserve(std::uint32_t num_parcels) {
  if (num_parcels == reserved_ && num_slices_ > 0) return;
  *this = [&] {
    ExactMemory empty;
    empty.time_s_ = time_s_;
    empty.now_ = now_;
    empty.is_active_ = is_active_;
    empty.state_ = std::move(state_);
    return empty;
  }();
  num_slices_ = exact_num_slices(num_parcels);
  const std::uint32_t in_slice = num_parcels / num_slices_;
  // Few parcels may all be in one crowd, with many events of each in a tick, and cost little memory.
  const std::uint32_t more = num_slices_ <= 4 ? 8192 : (in_slice < 4096 ? 512 : 64);
  active_capacity_ = in_slice / kActiveShare + more;
  member_capacity_ = active_capacity_ + in_slice / kJoinedShare + more;
  segment_capacity_ = in_slice / kSegmentShare + 4 * more;
  neighbour_pair_capacity_ = in_slice / kNeighbourPairShare + 8 * more;
  const auto all = [&](std::uint32_t capacity) { return static_cast<std::size_t>(capacity) * num_slices_; };
  const std::size_t common = num_parcels / kCommonShare + kMinCommon;
  active_ = DeviceBuffer<std::uint32_t>(all(active_capacity_));
  counts_ = DeviceBuffer<SliceCounts>(num_slices_);
  representatives_ = DeviceBuffer<std::uint32_t>(all(active_capacity_));
  members_ = DeviceBuffer<ClusterMember>(all(member_capacity_));
  records_ = DeviceBuffer<ClusterRecord>(all(member_capacity_) + 1);
  segments_ = DeviceBuffer<TrajectorySegment>(all(segment_capacity_));
  neighbour_pairs_ = DeviceBuffer<uint2>(all(neighbour_pair_capacity_));
  near_ball_ = DeviceBuffer<std::uint32_t>(num_parcels / kNearBallShare + kMinCommon);
  todo_ = DeviceBuffer<std::uint32_t>(common);
  conflicts_ = DeviceBuffer<uint2>(common);
  ball_segments_ = DeviceBuffer<BallTrajectorySegment>(kMaxBallSegments);
  reserved_ = num_parcels;
}

std::size_t ExactMemory::bytes() const {
  return active_.bytes() + counts_.bytes() + representatives_.bytes() + members_.bytes() + records_.bytes() +
         segments_.bytes() + neighbour_pairs_.bytes() + near_ball_.bytes() + todo_.bytes() + conflicts_.bytes() +
         ball_segments_.bytes();
}

void ExactMemory::complete(const Memory& memory, ExactLaunch& launch) const {
  ExactArrays& a = launch.arrays;
  a.trajectories = memory.trajectories;
  a.present[0] = memory.free.position;
  a.present[1] = reinterpret_cast<Vec2i*>(memory.free.velocity);
  a.list_head = memory.free.tick;
  a.member_slot = memory.free.id;
  a.event_tick = memory.scratch[0];
  a.event_partner = memory.scratch[1];
  a.owner = memory.scratch[2];
  a.active = {active_.data(), active_capacity_};
  a.representatives = {representatives_.data(), num_slices_ * active_capacity_};
  a.num_slices = num_slices_;
  a.members = members_.data();
  a.records = records_.data();
  a.segments = segments_.data();
  a.neighbour_pairs = neighbour_pairs_.data();
  a.counts = counts_.data();
  a.member_capacity = member_capacity_;
  a.segment_capacity = segment_capacity_;
  a.neighbour_pair_capacity = neighbour_pair_capacity_;
  const auto common = static_cast<std::uint32_t>(reserved_ / kCommonShare + kMinCommon);
  a.near_ball = {near_ball_.data(), reserved_ / kNearBallShare + kMinCommon};
  a.todo = {todo_.data(), common};
  a.conflicts = conflicts_.data();
  a.conflict_capacity = common;
  a.ball_segments = ball_segments_.data();
  a.ball_segment_capacity = kMaxBallSegments;
  launch.state = state_.data();
}

void ExactMemory::enter(const ExactLaunch& launch, cudaStream_t stream) {
  now_ = static_cast<std::uint64_t>(std::llround(time_s_ / launch.run.reference_ticks.tick_s));
  // Padding too, which the copy to the host reads.
  PF_CUDA(cudaMemsetAsync(state_.data(), 0, sizeof(ExactState), stream));
  launch_exact_enter(launch, now_, stream);
  is_active_ = true;
}

std::vector<std::uint64_t> ExactMemory::plan(const StepRequest& request, double tick_s) {
  std::vector<std::uint64_t> ends;
  const double start_s = time_s_;
  check_is_countable(start_s + request.num_steps * request.dt_s, tick_s);
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    time_s_ = start_s + k * request.dt_s;
    const auto end = static_cast<std::uint64_t>(std::llround(time_s_ / tick_s));
    if (end > now_) ends.push_back(now_ = end);
  }
  return ends;
}

}  // namespace pf
