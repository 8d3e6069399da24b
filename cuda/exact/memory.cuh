// Method `exact` on the device from step to step, the host's part: buffers, when steps end, what to launch.
#pragma once

#include "backend/backend.hpp"
#include "cuda/device_buffer.cuh"
#include "cuda/exact/step_state.cuh"

namespace pf {

class ExactMemory {
 public:
  // Whether the parcels' positions are anchors of lines.
  bool active() const { return is_active_; }
  void reset_time();
  void forget() { is_active_ = false; }

  // Makes room; what the clusters need is kept until more parcels need more.
  void reserve(std::uint32_t num_parcels);
  std::uint32_t reserved() const { return reserved_; }
  std::size_t bytes() const;
  // Beside the ticks, which lie with the parcels: members and records of clusters, active parcels and
  // leaders, lines, pairs of neighbours, and what is near the ball.
  static constexpr double kBytesPerParcel = 8.0 + 44.0 + 2.0 + 2.0 + 2.0 + 1.0;

  // `free`: arrays of as many parcels that the last sort left. scratch: three arrays. Completes a launch's
  // arrays.
  struct Memory {
    ParcelPointers trajectories, free;
    std::uint32_t* scratch[3];
  };
  void complete(const Memory& memory, ExactLaunch& launch) const;

  void enter(const ExactLaunch& launch, cudaStream_t stream);
  // Ticks at which the steps of a request end, the present one first.
  std::vector<std::uint64_t> plan(const StepRequest& request, double tick_s);

  ExactState* state() const { return state_.data(); }

 private:
  bool is_active_ = false;
  double time_s_ = 0.0;
  std::uint64_t now_ = 0;
  std::uint32_t reserved_ = 0;
  std::uint32_t num_slices_ = 0;
  std::uint32_t active_capacity_ = 0, member_capacity_ = 0, segment_capacity_ = 0, neighbour_pair_capacity_ = 0;
  DeviceBuffer<std::uint32_t> active_, representatives_, near_ball_, todo_;
  DeviceBuffer<SliceCounts> counts_;
  DeviceBuffer<ClusterMember> members_;
  DeviceBuffer<ClusterRecord> records_;
  DeviceBuffer<TrajectorySegment> segments_;
  DeviceBuffer<uint2> neighbour_pairs_, conflicts_;
  DeviceBuffer<BallTrajectorySegment> ball_segments_;
  DeviceBuffer<ExactState> state_{1};
};

}  // namespace pf
