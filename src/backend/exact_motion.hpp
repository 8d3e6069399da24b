// Method `exact` on the CPU from step to step: the time, the parcels' present positions, the ball's line,
// when to sort, and how long a step may be.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/backend.hpp"
#include "backend/exact_stepper.hpp"
#include "backend/sorted_parcels.hpp"

namespace pf {

class ExactMotion {
 public:
  explicit ExactMotion(ThreadTeam& team) : team_(team), stepper_(team) {}

  // Whether the positions of the parcels are anchors of lines, and present() is where they are.
  bool active() const { return active_; }
  const std::vector<Vec2i>& present() const { return present_; }

  void reset_time();
  // The ball was set from outside: its line starts there.
  void forget_ball() { ball_follows_ = false; }
  // Anchors every parcel where it is now.
  void enter(const Physics& physics, double contact_clock_s, SortedParcels& parcels);
  // Positions become the present ones.
  void leave(SortedParcels& parcels);
  // Advances by the whole request. The ball's state is that at its end afterwards.
  void advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels, BallState& ball,
               StepReport& report);

  std::uint64_t memory_bytes() const;

 private:
  std::uint32_t longest_step(const ExactConstants& c) const;
  void bound_speeds(ExactConstants& c, const Physics& physics, const BallState& ball) const;
  void sort_if_due(const ExactConstants& c, SortedParcels& parcels, StepReport& report);
  void find_present(const ExactConstants& c, const SortedParcels& parcels);
  ExactBall ball_in_step(const ExactConstants& c, const BallState& ball);
  void end_step(const ExactConstants& c, const ExactBall& ball, SortedParcels& parcels, BallState& state);
  void anchor_all(SortedParcels& parcels);
  void one_step(const ExactConstants& constants, std::uint64_t until, const StepRequest& request,
                SortedParcels& parcels, BallState& ball, StepReport& report);

  ThreadTeam& team_;
  ExactStepper stepper_;
  bool active_ = false;
  std::uint64_t now_ = 0;       // ticks since the reset
  double time_s_ = 0.0;         // what was asked for since the reset: now_ is its nearest tick
  std::vector<Vec2i> present_;  // n + kSearchPadding
  std::vector<Vec2i> at_end_;
  std::int64_t travel_ = 0;        // bound on displacements along an axis since the sort
  double fastest_mps_ = 0.0;       // bound on the parcels' present speeds
  double raised_bound_mps_ = 0.0;  // after a step in which something was faster than assumed
  BallLine ball_line_;             // of a ball that flies straight, from its last event on
  bool ball_follows_ = false;      // whether ball_line_ holds
};

}  // namespace pf
