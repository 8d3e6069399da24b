// The CPU backend: the same step as on the device, as plain loops over a fixed partition. The device is
// tested against it, so that its correctness should be evident from the text.
#pragma once

#include <vector>

#include "backend/backend.hpp"
#include "backend/cpu_tally.hpp"
#include "backend/exact/timeline.hpp"
#include "backend/neighbour_search.hpp"
#include "backend/parcel_arrays.hpp"
#include "backend/time_step/paired_loop.hpp"

namespace pf {

class CpuBackend final : public Backend {
 public:
  explicit CpuBackend(unsigned num_threads);
  // From now on the plain loop makes the steps, for tests. Initially, if the processor can, PairedLoop does.
  void use_plain_loop() {
    is_plain_ = true;
    parcels_.sorted = false;
  }

  std::string name() const override { return "cpu"; }
  std::string device() const override;
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
  using RangeFunction = void (CpuBackend::*)(const StepLoop&, std::size_t, std::size_t, CpuTally&);

  template <class Contact, bool kBall, Boundary kBoundary>
  void step_range(const StepLoop& loop, std::size_t begin, std::size_t end, CpuTally& tally);

  std::size_t size() const { return parcels_.size(); }
  // Current positions, in memory order.
  const std::vector<Vec2i>& positions() {
    return exact_.active() ? exact_.positions(parcels_) : parcels_.current.position;
  }
  bool is_search_near(const StepConstants& constants) const;
  void take_snapshot(ParcelSnapshot& snapshot);
  void sort_if_needed(const StepConstants& constants, const StepRequest& request, StepReport& report);
  void step(const StepConstants& constants, const StepRequest& request, bool last, StepReport& report);
  // One pass over all parcels; the new state becomes the current one. range: null for paired_.
  CpuTally run_loop(const StepConstants& constants, const StepRequest& request, const BallMotion& motion,
                    const DrawBuffers* draw, RangeFunction range);
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
  PairedLoop paired_{team_};
  bool is_plain_ = !PairedLoop::is_supported();
  ExactTimeline exact_{team_};
  std::int64_t displacement_ = 0;  // bound on displacements along an axis since the sort, position units
  StepReport report_;              // of the last request
};

}  // namespace pf
