#pragma once

#include <vector>

#include "cuda/cell_sort.cuh"
#include "cuda/cuda_backend.hpp"
#include "cuda/device_buffer.cuh"
#include "cuda/exact/memory.cuh"
#include "cuda/timer.cuh"
#include "cuda/setup_kernels.cuh"
#include "cuda/time_step/kernel.cuh"

namespace pf {

class CudaBackend final : public Backend {
 public:
  explicit CudaBackend(int device);
  ~CudaBackend() override;

  std::string name() const override { return "cuda"; }
  std::string device() const override { return device_name_; }
  void reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) override;
  void set_physics(const Physics& physics) override;
  void set_ball(const BallState& ball) override;
  void restore(const ParcelSnapshot& snapshot) override;
  void submit(const StepRequest& request) override;
  StepReport collect() override;
  void draw(const DrawBuffers& buffers) override;
  ParcelSnapshot snapshot() override;
  Measures measure() override;
  std::uint64_t state_hash() override;
  std::uint64_t memory_bytes() const override;
  double min_bytes_moved(const StepTotals& totals) const override;
  double measure_copy_bandwidth(std::size_t num_bytes) override;

 private:
  struct Parcels {
    DeviceBuffer<Vec2i> position;
    DeviceBuffer<Vec2f> velocity;
    DeviceBuffer<std::uint32_t> id;
    DeviceBuffer<std::uint32_t> tick, last_contact_tick;  // method exact; see ParcelPointers
    ParcelPointers pointers() const {
      return {position.data(), velocity.data(), id.data(), tick.data(), last_contact_tick.data()};
    }
    std::size_t bytes() const {
      return position.bytes() + velocity.bytes() + id.bytes() + tick.bytes() + last_contact_tick.bytes();
    }
  };

  // What collect() needs to know of the request.
  struct Submitted {
    std::uint32_t num_steps = 0;
    std::uint64_t num_sorts = 0;
    bool exact = false;
    double per_impulse_count = 1.0;
    double impulse_unit_kg_mps = 0.0;
  };

  // Method exact, in cuda_backend_exact.cpp.
  void submit_exact(const StepRequest& request);
  const ExactState& read_exact_state();  // waits
  void start_exact(const StepRequest& request);
  void stop_exact();
  void push_out(const StepRequest& request);
  void make_room_for_exact(bool with_clock);
  void sort_exact(ExactLaunch& launch);
  ExactLaunch plan_exact(const StepRequest& request) const;
  ParcelPointers present_parcels() const;

  void make_room(std::uint32_t num_parcels);
  void sort(const StepConstants& constants);
  StepLaunch plan_launch(const StepConstants& constants, const StepRequest& request) const;
  void step(StepLaunch& launch, bool sort_follows);
  bool sort_is_due(const StepConstants& constants) const;
  DrawBuffers device_draw_buffers(const DrawBuffers& wanted);
  void copy_to_host(const DrawBuffers& from, const DrawBuffers& to);
  std::vector<MeasurePart> measure_parts();
  StepState read_state();
  void write_state(const StepState& state);

  std::string device_name_;
  cudaStream_t stream_{};
  Physics physics_;
  std::uint32_t num_parcels_ = 0;
  std::uint32_t capacity_ = 0;
  Parcels current_;  // sorted by cell at the last sort
  Parcels next_;
  DeviceCellSort cell_sort_;
  DeviceBuffer<Vec2f> draw_position_;  // only for draw targets in host memory
  DeviceBuffer<float> draw_speed_;
  DeviceBuffer<StepState> state_{1};
  DeviceBuffer<TallySlot> slots_{kNumSlots};
  PinnedValue<StepState> host_state_;  // as of the last collected request
  GridShape grid_;
  RequestTimer timer_;
  ExactMemory exact_;
  std::uint32_t steps_since_sort_ = 0;  // of exact
  PinnedValue<ExactState> host_exact_;  // as of the last collected request
  bool ball_was_set_ = false;
  bool sorted_ = false;
  bool keys_are_written_ = false;  // of the present positions in grid_
  Submitted submitted_;
  std::int64_t expected_displacement_ = 0;  // since the sort: known up to the last request, then estimated
};

}  // namespace pf
