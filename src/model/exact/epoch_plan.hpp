// Method `exact`: plans of epochs, chords and windows. Host and device code.
//
// In an epoch, cells and predictions that were made at its start hold. A chord is a piece of the ball's
// flight, which is straight in the model. A window is what is solved at once. Results depend on chords, if
// the ball's flight is curved, and on neither epochs nor windows.
#pragma once

#include <cstdint>

#include "model/exact/step_plan.hpp"

namespace pf {

// Length of an epoch that suits a gas: displacement at the bound on speeds, contact distances or mean
// distances of parcels, whichever is longer. Search boxes are that much wider. Without contacts it is that
// with the ball, if longer.
constexpr double kEpochContacts = 1.25;
constexpr double kEpochSpacings = 0.6;

// Largest turn of the ball's velocity in a chord, radians, and largest part of its speed that drag takes.
constexpr double kMaxChordTurn = 1.0 / 16.0;

// Longest epoch whose search boxes hold few parcels, ticks.
PF_HD inline double preferred_epoch_ticks(const ExactConstants& c) {
  const World& world = c.run.physics.world;
  const double area = 4.0 * world.half.x * world.half.y;
  const double spacing = sqrt(area / (c.run.physics.parcels.num + 1.0));
  const double by_contact = kEpochContacts * c.run.contact_distance, by_spacing = kEpochSpacings * spacing;
  double units = by_contact > by_spacing ? by_contact : by_spacing;
  // Parcels that pass through each other are searched for at the ball only.
  if (!c.run.physics.parcels.contacts && units < c.run.ball_contact) units = c.run.ball_contact;
  return units / (c.plan.max_speed_mps * c.plan.units_per_tick);
}

// Plans the epoch that starts now. The ball's role is set by its chords. longer: multiple of the preferred
// length.
PF_HD inline StepPlan plan_epoch(const RunConstants& run, const ExactProgress& progress, double longer) {
  ExactConstants c{run, plan_of_now(run, progress)};
  c.plan.max_speed_mps = assumed_bound_mps(run.physics, c.plan.reference_speed_mps, progress, 1.0);
  c.plan.ball = run.physics.ball.exists ? BallRole::participant : BallRole::absent;
  const std::uint32_t possible = max_step_ticks(c, 0);
  const std::uint64_t to_anchoring = ticks_to_anchoring(progress);
  c.plan.length = to_anchoring < possible ? static_cast<std::uint32_t>(to_anchoring) : possible;
  const double preferred = longer * preferred_epoch_ticks(c);
  if (preferred < c.plan.length) c.plan.length = preferred > 1.0 ? static_cast<std::uint32_t>(preferred) : 1U;
  c.plan.ball = BallRole::absent;
  return c.plan;
}

// Returns whether the ball flies straight whatever hits it.
PF_HD inline bool always_flies_straight(const BallConstants& ball) { return flies_straight(ball, 1.0); }

// Length of the chord that starts now, ticks. It ends at the latest in the tick of `until` and where
// trajectories are anchored anew. It depends on nothing else but the ball's state.
PF_HD inline std::uint32_t chord_ticks(const RunConstants& run, const ExactProgress& progress,
                                       std::uint64_t until) {
  const std::uint64_t wanted = ticks_until_anchoring_or(progress, until);
  const BallConstants& ball = run.physics.ball;
  if (ball.held) return static_cast<std::uint32_t>(wanted);
  const double tick_s = run.reference_ticks.tick_s * static_cast<double>(1ULL << progress.tick_exponent);
  const double turn_per_s = ball.magnus_per_rad * progress.ball.spin_radps;
  const double drag_per_s = ball.drag_per_m * length(progress.ball.velocity_mps);
  const double bend_per_s = (turn_per_s < 0.0 ? -turn_per_s : turn_per_s) + drag_per_s;
  const double parts = static_cast<double>(wanted) * tick_s * bend_per_s / kMaxChordTurn;
  const std::uint64_t num = parts < static_cast<double>(wanted) ? static_cast<std::uint64_t>(parts) + 1
                                                                : wanted;  // a chord lasts one tick at least
  return static_cast<std::uint32_t>((wanted + num - 1) / num);
}

// Plans the chord that starts now.
PF_HD inline StepPlan plan_chord(const RunConstants& run, const ExactProgress& progress,
                                 std::uint64_t until) {
  StepPlan chord = plan_of_now(run, progress);
  chord.length = chord_ticks(run, progress, until);
  chord.ball = ball_role(run.physics, progress.ball, chord.length * chord.tick_s);
  return chord;
}

// The ball within a chord, at a tick that counts as those of its trajectory. A frozen ball has not received
// its impulses yet. ball: at the chord's start.
inline BallState ball_in_chord(const Physics& physics, const StepPlan& chord,
                               const BallTrajectory& trajectory, std::int64_t tick, BallState ball) {
  const Vec2d moved = displacement_units(chord, trajectory.velocity_mps, tick - trajectory.tick);
  ball.position_m = (trajectory.anchor_units + moved) * physics.world.unit_m;
  ball.velocity_mps = trajectory.velocity_mps;
  ball.spin_radps = trajectory.spin_radps;
  apply_boundary_to_ball(physics.world, physics.ball.radius_m, ball);
  return ball;
}

}  // namespace pf
