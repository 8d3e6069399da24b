// Compares method `exact` with the lab's reference: the partners of each parcel, in order.
//
// In a chaotic gas any two codes diverge within ten collisions (docs/physics.md, 'How long two runs can be
// compared'), so the reference starts anew from the state of `exact` in each of many short windows. If a
// parcel's partners differ, there must be a reason: two of its events are closer in time than rounding can
// order; a pair passes so nearly at one contact distance that rounding decides whether it touches; the window
// ends; or it collided with a parcel that had such a reason earlier in the window.
#pragma once

#include <cstdint>
#include <string>

#include "lab/reference.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

struct MatchPlan {
  double collisions_per_window = 0.5;  // per parcel, at the current temperature
  std::uint32_t steps_per_window = 1;
  int num_windows = 1;
  double flown_s = 0.0;         // before the first window; run.ball is the ball then
  double wrong_radius_m = 0.0;  // radius in the reference, to see the comparison fail; 0: the scene's
};

struct MatchResult {
  std::uint64_t num_events = 0;   // of the reference
  std::uint64_t num_windows = 0;  // that had parcels left
  // Lists of partners (one per parcel and window) that differ, by reason.
  std::uint64_t num_near_ties = 0;
  std::uint64_t num_grazing = 0;
  std::uint64_t num_at_end = 0;
  std::uint64_t num_consequences = 0;
  std::uint64_t num_unexplained = 0;
  double max_shift = 0.0;  // difference in time of an event that both have, times speed over parcel diameter
  // Difference in velocity of the ball, or of its rim, over reference speed; in windows without differences.
  double max_ball_difference = 0.0;
  std::string first_unexplained;

  std::uint64_t num_differences() const { return num_explained() + num_unexplained; }
  std::uint64_t num_explained() const { return num_near_ties + num_grazing + num_at_end + num_consequences; }
};

// Runs the scene, whose method is `exact`, through the windows.
MatchResult match_events(SceneRun& run, const MatchPlan& plan);

}  // namespace pf::test
