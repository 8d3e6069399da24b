// The CUDA backend's class. Requests of the time-stepped methods are in requests.cpp, those of method `exact`
// in exact/requests.cpp.
#pragma once

#include <vector>

#include "cuda/cell_sort.cuh"
#include "cuda/cuda_backend.hpp"
#include "cuda/device_buffer.cuh"
#include "cuda/exact/memory.cuh"
#include "cuda/exact/timeline.hpp"
#include "cuda/launch_batches.cuh"
#include "cuda/parcel_arrays.cuh"
#include "cuda/setup_kernels.cuh"
#include "cuda/time_step/contact_memory.cuh"
#include "cuda/time_step/kernel.cuh"
#include "cuda/timer.cuh"

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
  void save(BackendState& state) override;
  void resume(const Physics& physics, const BackendState& state) override;
  Measures measure() override;
  Profile profile(const ProfileShape& shape) override;
  std::uint64_t state_hash() override;
  std::uint64_t memory_bytes() const override;
  double min_bytes_moved(const StepTotals& totals) const override;
  double measure_copy_bandwidth(std::size_t num_bytes) override;

 private:
  // Values of the request that collect() needs.
  struct Submitted {
    std::uint32_t num_steps = 0;
    double dt_s = 0.0;  // of the time-stepped methods
    std::uint64_t num_sorts = 0;
    std::uint32_t num_ends = 0;            // of end_steps()
    std::uint32_t num_sorts_in_steps = 0;  // of num_sorts
    bool exact = false;
    double per_impulse_count = 1.0;
    double impulse_unit_kg_mps = 0.0;
  };

  // When the steps of a request of method `exact` end, and when they need a sort.
  struct ExactRequest {
    std::vector<cuda::ExactTimeline::End> ends;
    std::uint32_t num_together = 1;  // steps that are taken as one
    bool searches = false;           // else nothing is ever sorted
    bool sorts_within = false;       // steps may stop on their way for a sort
    double displacement = 0.0;       // expected in these, position units
    double sort_displacement = 0.0;  // since the sort; beyond it parcels are sorted again, position units
  };

  // Method `exact`, in cuda/exact/requests.cpp.
  void submit_exact(const StepRequest& request);
  const cuda::ExactState& read_exact_state();  // waits
  void start_exact(const StepRequest& request);
  void stop_exact();
  void push_out(const StepRequest& request);
  void make_room_for_exact(bool with_contact_ticks);
  void check_room_for_exact(bool with_contact_ticks) const;
  cuda::ExactLaunch exact_launch(const StepRequest& request) const;
  cuda::StepMemory lay_out_exact() const;
  std::uint32_t steps_together(const RunConstants& run, const StepRequest& request,
                               double displacement) const;
  ExactRequest plan_exact(const RunConstants& run, const StepRequest& request);
  void finish_exact(StepReport& report);
  void step_exact(const ExactRequest& plan, cuda::ExactLaunch& launch);
  static void set_ends(const ExactRequest& plan, std::size_t first, cuda::ExactLaunch& launch);
  bool exact_sort_is_due(const ExactRequest& plan) const;
  void sort_exact(cuda::ExactLaunch& launch);
  void launch_exact_stages(const cuda::ExactLaunch& launch);
  ParcelPointers current_parcels() const;

  // In cuda/state.cpp.
  void save_exact(ExactSnapshot& exact);
  void resume_exact(const BackendState& state);

  using LaunchStep = void (*)(const StepLaunch&, cudaStream_t);

  void make_room(std::uint32_t num_parcels);
  void sort(const StepConstants& constants);
  StepLaunch plan_launch(const StepConstants& constants, const StepRequest& request) const;
  void step(StepLaunch& launch, LaunchStep launch_parcels);
  void step_in_parts(StepLaunch& launch);
  void set_source(StepLaunch& launch) const;
  DisplacedSinceSort displaced_since_sort(const StepLaunch& launch, bool is_just_sorted) const;
  void begin_sort_in_step(StepLaunch& launch);
  void end_counting(StepLaunch& launch);
  bool make_room_for_contacts();
  void note_step(StepLaunch& launch, bool next_moves_ball);
  void end_steps(StepLaunch& launch);
  bool sort_is_due(const StepConstants& constants, double widest) const;
  bool can_sort_in_step(const StepConstants& constants) const;
  DrawBuffers device_draw_buffers(const DrawBuffers& wanted);
  void copy_to_host(const DrawBuffers& from, const DrawBuffers& to);
  void take_snapshot(ParcelSnapshot& to);
  void clear_heated();
  void list_heated(std::vector<std::uint32_t>& to);
  ParcelSums sums() const;
  StepState read_state();
  void write_state(const StepState& state);
  StepTotals collected_totals() const;

  std::string device_name_;
  cudaStream_t stream_{};
  Physics physics_;
  std::uint32_t num_parcels_ = 0;
  std::uint32_t capacity_ = 0;
  DeviceParcels current_;  // in the order of the last sort
  DeviceParcels next_;     // where the next sort puts them; else, and until it does, the scratch of methods
  DeviceCellSort cell_sort_;
  ContactMemory contact_memory_;       // where steps are done in parts
  DeviceBuffer<Vec2f> draw_position_;  // for draw targets in host memory only
  DeviceBuffer<float> draw_speed_;
  DeviceBuffer<StepState> state_{1};
  DeviceBuffer<TallySlot> slots_{kMaxOpenSteps * kNumSlots};
  PinnedValue<StepState> host_state_;  // as of the last collected request
  GridShape grid_;
  RequestTimer timer_;
  LaunchBatches batches_;
  cuda::ExactTimeline exact_;
  cuda::ExactMemory exact_memory_;
  PinnedValue<cuda::ExactState> host_exact_;  // as of the last collected request
  std::uint32_t exact_steps_since_sort_ = 0;
  bool ball_was_set_ = false;
  bool sorted_ = false;
  Submitted submitted_;
  std::int64_t expected_displacement_ = 0;  // since the sort: known up to the last request, then estimated
};

}  // namespace pf
