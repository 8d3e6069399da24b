// Flights that are shown beside each other: what was set, the path, what it cost; and the paths that the same
// launch would take without parcels.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/vec2.hpp"
#include "scene/settings.hpp"

namespace pf {

// One flight of the ball, from its launch on.
struct FlightRecord {
  std::int64_t launch = 0;  // flights of one number were launched alike: same ball, same seed of the air
  bool fresh_air = true;    // the air was spawned for it; else it is as earlier flights left it
  bool disturbed = false;   // a setting that bears on it was changed on the way
  Air air = Air::parcels;
  Method method = Method::impulse;
  double set_dt_s = 0.0;  // as set; 0: from the displacement
  double dt_s = 0.0;      // of the last step
  double speed_mps = 0.0;
  double spin_radps = 0.0;
  std::vector<Vec2f> points_m;  // one per frame, oldest first
  std::vector<double> times_s;  // of the points, since the launch
  std::uint64_t num_steps = 0;
  double compute_ms = 0.0;  // of all its steps
  double start_energy_j = 0.0;
  std::optional<double> end_energy_j;  // when it ended

  double time_s() const { return times_s.empty() ? 0.0 : times_s.back(); }
  // Relative; empty while it flies, if it was disturbed, and without energy.
  std::optional<double> energy_drift() const;
};

// How far two flights are from each other at the same times, as long as both last.
struct FlightDistance {
  double at_end_m = 0.0;
  double largest_m = 0.0;
  double until_s = 0.0;
};
// Empty if one of them has no path yet.
std::optional<FlightDistance> distance_between(const FlightRecord& a, const FlightRecord& b);

// The path from the settings' launch with another kind of air (vacuum or drag), Magnus as set: until it
// leaves the world, or after a while. Empty without a ball that moves. Throws UserError for settings that
// cannot run.
std::vector<Vec2f> ghost_path(const Settings& settings, Air air);

struct Ghost {
  Air air = Air::vacuum;
  std::vector<Vec2f> points_m;
};
// Both kinds, less the one that the settings have themselves.
std::vector<Ghost> ghosts_of(const Settings& settings);

}  // namespace pf
