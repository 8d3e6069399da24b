// The CPU backend: the same step as on the device, in loops that threads share. The device is tested against
// it; it is tested against a plain loop (time_step/time_stepper.cpp), whose correctness should be evident
// from the text.
#pragma once

#include <vector>

#include "backend/backend.hpp"
#include "backend/cpu_tally.hpp"
#include "backend/exact/timeline.hpp"
#include "backend/parcel_arrays.hpp"
#include "backend/time_step/time_stepper.hpp"

namespace pf {

class CpuBackend final : public Backend {
 public:
  explicit CpuBackend(unsigned num_threads);
  // See TimeStepper.
  void use_plain_loop() { stepper_.use_plain_loop(); }

  std::string name() const override { return "cpu"; }
  std::string device() const override;
  std::unique_ptr<Backend> with_threads(unsigned num_threads) const override {
    return make_cpu_backend(num_threads);
  }
  void reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) override;
  void set_physics(const Physics& physics) override;
  void set_ball(const BallState& ball) override;
  void restore(const ParcelSnapshot& snapshot) override;
  void submit(const StepRequest& request) override;
  StepReport collect() override { return report_; }
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
  std::size_t size() const { return parcels_.size(); }
  // Current positions, in memory order.
  const std::vector<Vec2i>& positions() {
    return exact_.active() ? exact_.positions(parcels_) : parcels_.current.position;
  }
  void take_snapshot(ParcelSnapshot& snapshot);
  void sort_if_needed(const StepConstants& constants, const StepRequest& request, StepReport& report);
  void step(const StepConstants& constants, const StepRequest& request, bool last, StepReport& report);
  void advance_exact(const StepRequest& request, StepReport& report);
  // Pushes overlapping parcels apart until none overlap, or a limit is reached.
  void push_apart(const StepRequest& request);
  void start_exact(const StepRequest& request);
  void stop_exact();

  ThreadTeam team_;
  Physics physics_;
  BallState ball_;
  std::uint64_t step_ = 0;  // steps since the reset; keys the random roundings
  SortedParcels parcels_;
  TimeStepper stepper_{team_, parcels_};
  ExactTimeline exact_{team_};
  StepReport report_;  // of the last request
};

}  // namespace pf
