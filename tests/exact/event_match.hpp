// Whom each parcel meets, in which order: method `exact` against the lab's reference.
//
// A chaotic gas makes any two codes part within ten collisions (docs/physics.md, 'How long two runs can be
// compared'), so the reference starts anew from the state of `exact` at the begin of each of many short
// windows. A parcel whose partners then differ must have a reason: two events of it closer in time than
// rounding can order; a pair that passes so closely at one contact distance that rounding decides whether it
// touches; the window's end; or it met a parcel for which such a reason was found earlier in the window.
#pragma once

#include <cstdint>
#include <string>

#include "lab/reference.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

struct MatchPlan {
  double collisions_per_window = 0.5;  // of a parcel, at the present temperature
  std::uint32_t steps_per_window = 1;
  int num_windows = 1;
  // What the reference has instead of the scene's, to see the comparison fail; 0: the scene's.
  double wrong_radius_m = 0.0;
};

struct MatchResult {
  std::uint64_t num_events = 0;   // of the reference
  std::uint64_t num_windows = 0;  // that had parcels left
  // Parcels and windows in which the lists of partners differ, by reason.
  std::uint64_t num_near_ties = 0;
  std::uint64_t num_grazing = 0;
  std::uint64_t num_at_end = 0;
  std::uint64_t num_consequences = 0;
  std::uint64_t num_unexplained = 0;
  double largest_shift = 0.0;  // of the time of an event that both have, times speed over parcel diameter
  // Velocity of the ball, or of its rim, at the end of a window without differences, over reference speed.
  double largest_ball_difference = 0.0;
  std::string first_unexplained;

  std::uint64_t num_differences() const { return num_explained() + num_unexplained; }
  std::uint64_t num_explained() const { return num_near_ties + num_grazing + num_at_end + num_consequences; }
};

// Runs the scene, whose method is `exact`, through the windows.
MatchResult match_events(SceneRun& run, const MatchPlan& plan);

}  // namespace pf::test
