// Method `exact` on the CPU: predictions from start trajectories.
#pragma once

#include "backend/exact/window.hpp"

namespace pf {

// First stage of an epoch: every parcel's disc and next event, except events with the ball. Lists the parcels
// near the ball.
void predict_epoch(WindowContext& window);

// First stage of a chord: the next events with the ball, of the ball itself if it is a participant.
void predict_ball_events(WindowContext& window);

// The next event of a participating ball on its trajectory, while no window is being solved.
template <Boundary kBoundary>
Event next_ball_event(const WindowContext& window) {
  Event best;
  const BallTrajectory& ball = window.memory.ball.trajectory;
  for (const std::uint32_t i : window.memory.near_ball) {
    const Trajectory parcel = window.start_trajectory(i);
    if (is_retired(parcel.anchor)) continue;
    keep_earlier(best, {window.ball_tick<kBoundary>(ball, parcel), i, window.trajectories.id[i]});
  }
  Event edge;
  keep_ball_edge_event<kBoundary>(window.c, ball, edge);
  if (edge.tick < window.ball_end) keep_earlier(best, edge);
  return best;
}

}  // namespace pf
