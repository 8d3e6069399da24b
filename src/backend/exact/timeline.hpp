// Method `exact` on the CPU from step to step: the time, the parcels' positions, sorting and anchoring.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/backend.hpp"
#include "backend/exact/stepper.hpp"
#include "backend/parcel_arrays.hpp"

namespace pf {

class ExactTimeline {
 public:
  explicit ExactTimeline(ThreadTeam& team) : team_(team), stepper_(team) {}

  // While active, the parcels' stored positions are anchors of trajectories, and positions() has the current
  // ones.
  bool active() const { return active_; }
  const std::vector<Vec2i>& positions() const { return position_; }

  void reset_time();
  // The ball was set from outside; its trajectory starts anew.
  void forget_ball() {
    progress_.ball_trajectory_holds = false;
    ball_is_new_ = true;
  }
  // Becomes active: anchors every parcel at its position. contact_clock_s: see StepRequest.
  void enter(const Physics& physics, double contact_clock_s, SortedParcels& parcels);
  // Stops being active: the stored positions become the current ones.
  void leave(SortedParcels& parcels);
  // Advances by the whole request. ball: state at its start, then at its end.
  void advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels, BallState& ball,
               StepReport& report);

  std::uint64_t memory_bytes() const;

 private:
  void sort_if_due(const ExactConstants& c, SortedParcels& parcels, StepReport& report);
  void locate(const ExactConstants& c, const SortedParcels& parcels);
  double fastest_parcel_mps(const SortedParcels& parcels) const;
  double fastest_mps(const Physics& physics, const SortedParcels& parcels) const;
  bool ball_needs_finer_ticks(const RunConstants& run) const;
  void anchor_all(const RunConstants& run, SortedParcels& parcels);
  void advance_step(const RunConstants& run, std::uint64_t until, const StepRequest& request,
                    SortedParcels& parcels, StepReport& report);
  StepInput step_input(const ExactConstants& c, Neighbors neighbors, const SortedParcels& parcels) const;
  std::uint32_t plan_retry(const StepPlan& failed, const StepOutcome& outcome, std::uint32_t max_ticks);
  void finish_step(const ExactConstants& c, const ExactBall& ball, const StepOutcome& outcome,
                   StepReport& report);

  ThreadTeam& team_;
  ExactStepper stepper_;
  bool active_ = false;
  bool ball_is_new_ = false;
  double time_s_ = 0.0;  // requested since the reset; progress_.now is the nearest tick
  ExactProgress progress_;
  std::vector<Vec2i> position_;  // n + kSearchPadding; leave() moves it to the parcels
  std::vector<Vec2i> end_position_;
};

}  // namespace pf
