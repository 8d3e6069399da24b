// Method `exact` on the device from step to step, the host's part: buffers, when steps end, what to launch.
#pragma once

#include "backend/backend.hpp"
#include "device_buffer.cuh"
#include "exact_kernel.cuh"

namespace pf {

class DeviceExact {
 public:
  // Whether the parcels' positions are anchors of lines.
  bool active() const { return active_; }
  void reset_time();
  void forget() { active_ = false; }

  // Makes room; the lists of the rounds are kept until more parcels need more.
  void reserve(std::uint32_t num_parcels);
  std::size_t bytes() const;
  // Beside the ticks, which lie with the parcels.
  static constexpr double kBytesPerParcel = 8.0 + 4.25 + 3.5;

  // `free`: arrays of as many parcels that the last sort left. scratch: three arrays, event_tick,
  // event_partner and bound. Completes a launch's arrays.
  struct Memory {
    ParcelPointers lines, free;
    std::uint32_t* scratch[3];
  };
  void complete(const Memory& memory, ExactLaunch& launch) const;

  void enter(const ExactLaunch& launch, cudaStream_t stream);
  // Ticks at which the steps of a request end, the present one first.
  std::vector<std::uint64_t> plan(const StepRequest& request, double tick_s);

  ExactState* state() const { return state_.data(); }

 private:
  struct List {
    DeviceBuffer<std::uint32_t> items, counts;
    std::uint32_t capacity = 0;
    SegmentedList view() const { return {items.data(), counts.data(), capacity, 0}; }
  };
  struct Lists {
    List list[6];
    DeviceBuffer<SavedLine> saved;
    DeviceBuffer<std::uint32_t> num_saved;
    std::uint32_t saved_capacity = 0;
    RoundLists view() const;
    std::size_t bytes() const;
  };
  static Lists make_lists(std::uint32_t num_parcels, std::uint32_t num_segments, std::uint32_t least);

  bool active_ = false;
  double time_s_ = 0.0;
  std::uint64_t now_ = 0;
  std::uint32_t reserved_ = 0;
  std::uint32_t num_segments_ = 0;
  Lists lists_, alone_;
  DeviceBuffer<ExactState> state_{1};
};

}  // namespace pf
