// Method `exact` on the CPU from step to step: the time, the parcels' present positions, and when to sort.
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

  // Whether the positions of the parcels are anchors of lines, and present() is where they are.
  bool active() const { return active_; }
  const std::vector<Vec2i>& present() const { return present_; }

  void reset_time();
  // The ball was set from outside: its line starts there.
  void forget_ball() {
    progress_.ball_trajectory_holds = false;
    ball_is_new_ = true;
  }
  // Anchors every parcel where it is now.
  void enter(const Physics& physics, double contact_clock_s, SortedParcels& parcels);
  // Positions become the present ones.
  void leave(SortedParcels& parcels);
  // Advances by the whole request. The ball's state is that at its end afterwards.
  void advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels, BallState& ball,
               StepReport& report);

  std::uint64_t memory_bytes() const;

 private:
  void sort_if_due(const ExactConstants& c, SortedParcels& parcels, StepReport& report);
  void locate(const ExactConstants& c, const SortedParcels& parcels);
  double fastest_parcel_mps(const SortedParcels& parcels) const;
  double fastest_mps(const Physics& physics, const SortedParcels& parcels) const;
  void anchor_all(const ExactConstants& base, SortedParcels& parcels);
  void one_step(const ExactConstants& base, std::uint64_t until, const StepRequest& request,
                SortedParcels& parcels, StepReport& report);

  ThreadTeam& team_;
  ExactStepper stepper_;
  bool active_ = false;
  bool ball_is_new_ = false;
  double time_s_ = 0.0;  // what was asked for since the reset: progress_.now is its nearest tick
  ExactProgress progress_;
  std::vector<Vec2i> present_;  // n + kSearchPadding: leave() hands it on
  std::vector<Vec2i> end_position_;
};

}  // namespace pf
