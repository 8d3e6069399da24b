// Flights of the ball for the studies. With every method, a seed has the same start.
#pragma once

#include <vector>

#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

struct CourtCase {
  std::int64_t num_parcels = 4000;
  double area_fraction = 0.1;
  double restitution = 0.9;
};

// Length of a flight over the court; it ends before the ball leaves.
inline constexpr double kCourtFlight_s = 0.6;

Settings court_settings(const CourtCase& court);

struct FlightResult {
  BallState ball;        // at the end
  double wall_ns = 0.0;  // of the steps, without spawning
  double dt_s = 0.0;     // of a step; a whole number of steps makes the flight
  StepTotals totals;
};

// Flies the scene for duration_s with its settings: method, time step or displacement_per_step, seed.
FlightResult fly_scene(const Settings& settings, double duration_s, Backend& backend);

struct Exit {
  Vec2d at_m;  // the ball's centre on the edge of the world
  double speed_mps = 0.0;
  double time_s = 0.0;  // since the launch
  double path_m = 0.0;
  double wall_ns = 0.0;
};

// Flies until the ball leaves the open world. Throws UserError if that takes more than 10 s.
Exit fly_to_exit(const Settings& settings, Backend& backend);

// A flight in frames, as a window asks for them.
struct FlightFrames {
  std::vector<double> frame_ms;  // of the physics
  StepTotals totals;
  BallState ball;        // at the end
  double time_s = 0.0;   // simulated
  bool refused = false;  // a request could not be resolved in order
};

// Flies frame by frame until the ball leaves the world, the flight has lasted max_time_s, or its frames
// together max_wall_s. The last frame may last longer.
FlightFrames fly_frames(const Settings& settings, double max_time_s, double max_wall_s, Backend& backend);

double speed_of(const BallState& ball);

}  // namespace pf
