// Method `exact` on the device: all memory of its steps.
//
// Lists of clusters have buffers of their own. Arrays with an entry for each parcel lie, beside the parcels'
// own, in arrays that a sort needs and steps do not: those that the next sort scatters to (`next`), its keys
// and its counts. Names are those of StepMemory; bytes are per parcel.
//
//   array                      bytes  holds, from the end of a sort to the start of the next one
//   current.position               8  trajectories.position: anchors
//   current.velocity               8  trajectories.velocity
//   current.id                     4  trajectories.id
//   current.tick                   4  trajectories.tick
//   current.last_contact_tick      4  trajectories.last_contact_tick; allocated with a contact duration only
//   next.position                  8  positions[0]
//   next.velocity                  8  positions[1], as Vec2i
//   next.id                        4  member_slot
//   next.tick                      4  list_head
//   next.last_contact_tick         4  nothing
//   cell_sort keys                 8  events
//   cell_sort counts               4  owner
//
// A sort starts with launch_count, which reads the positions at the step's start. The scatter then reads
// `current` and writes `next`, and the two change places. The sort ends with launch_locate, which computes
// the positions anew. Besides trajectories and positions, nothing in the table outlives a step.
#pragma once

#include "cuda/cell_sort.cuh"
#include "cuda/device_buffer.cuh"
#include "cuda/exact/kernels.cuh"
#include "cuda/parcel_arrays.cuh"

namespace pf::cuda {

class ExactMemory {
 public:
  // Makes room for the lists of num_parcels; keeps existing lists if the arguments are unchanged. The run's
  // state is kept. has_ball: now; a ball that is switched on or off while `exact` flies changes nothing here.
  void reserve(std::uint32_t num_parcels, bool has_ball);
  bool is_for(std::uint32_t num_parcels, bool has_ball) const {
    return num_parcels == reserved_ && has_ball == has_ball_ && num_slices_ > 0;
  }
  std::size_t bytes() const;
  // Members and clusters, active parcels and representatives, segments, pairs of neighbours, parcels near the
  // ball; and the ticks of current and next.
  static constexpr double kBytesPerParcel = 44.0 + 2.0 + 2.0 + 2.0 + 1.0 + 8.0;

  // Gives the regions of a grid their bounds on speeds, all 0.
  std::uint32_t* start_regions(const GridShape& grid, cudaStream_t stream);

  // The table above, and lists.
  StepMemory lay_out(const DeviceParcels& current, const DeviceParcels& next,
                     const DeviceCellSort& cell_sort) const;
  // Memory of positions[buffer].
  static Vec2i* positions(const DeviceParcels& next, std::uint32_t buffer);

  std::uint32_t* region_speed2() const { return region_speed2_.data(); }
  ExactState* state() const { return state_.data(); }

 private:
  void choose_capacities(std::uint32_t num_parcels);

  std::uint32_t reserved_ = 0;  // parcels
  bool has_ball_ = false;
  std::uint32_t num_slices_ = 0;
  // Items in a slice.
  std::uint32_t active_capacity_ = 0, member_capacity_ = 0, segment_capacity_ = 0,
                neighbour_pair_capacity_ = 0;
  DeviceBuffer<std::uint32_t> earliest_, region_speed2_, active_, representatives_, near_ball_, todo_;
  DeviceBuffer<SliceCounts> counts_;
  DeviceBuffer<Member> members_;
  DeviceBuffer<Cluster> clusters_;
  DeviceBuffer<TrajectorySegment> segments_;
  DeviceBuffer<uint2> neighbour_pairs_, conflicts_;
  DeviceBuffer<BallSegment> ball_segments_;
  DeviceBuffer<SegmentCause> segment_causes_;
  DeviceBuffer<BallHit> ball_hits_;
  DeviceBuffer<ExactState> state_{1};
};

}  // namespace pf::cuda
