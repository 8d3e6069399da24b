// Records of flights for comparison: settings, path, cost. Also the paths of the same launch without parcels.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/vec2.hpp"
#include "model/world.hpp"
#include "scene/settings.hpp"

namespace pf {

// One flight of the ball since its launch.
struct FlightRecord {
  std::int64_t number = 0;  // of the flights since the start of the scene, from 1; it does not change
  std::int64_t launch = 0;  // flights of equal number have the same ball and the same seed of the air
  bool fresh_air = true;    // the air was spawned for it; otherwise earlier flights went through it
  bool disturbed = false;   // a setting that affects it was changed during the flight
  bool has_left = false;    // it ended as the ball left the world, and was not cut short
  Air air = Air::parcels;
  Method method = Method::impulse;
  double set_dt_s = 0.0;   // the setting; 0: from the displacement
  bool half_step = false;  // half of the step that the scene has
  double dt_s = 0.0;       // of the last step
  Vec2d launch_mps;        // velocity at the launch
  double spin_radps = 0.0;
  Settings settings;            // at the launch, or where a run went on from a state
  std::vector<Vec2f> points_m;  // one per frame, oldest first
  std::vector<double> times_s;  // of the points, since the launch
  std::uint64_t num_steps = 0;
  double compute_ms = 0.0;  // of all its steps
  double start_energy_j = 0.0;
  std::optional<double> end_energy_j;  // when it ended

  double time_s() const { return times_s.empty() ? 0.0 : times_s.back(); }
  // Relative. Empty during the flight, if it was disturbed, and if the initial energy is zero.
  std::optional<double> energy_drift() const;
};

// "vacuum" or "drag in closed form"; empty: parcels.
const char* air_name(Air air);
// The kind of air; with parcels the method.
const char* name_of_flight(const FlightRecord& flight);

// The way between two positions, m: in a periodic world the shorter one, through an edge, if there is one.
Vec2d nearest_way(const World& world, Vec2d from_m, Vec2d to_m);
// Returns whether that way crosses no edge.
inline bool is_straight_way(Vec2d from_m, Vec2d to_m, Vec2d way_m) { return way_m == to_m - from_m; }

// The flight that the others of the current one's launch are compared with: the first one that was not cut
// short, or if there is none the first one.
const FlightRecord& reference_of(const FlightRecord& current, const std::deque<FlightRecord>& old_flights);
// Returns whether there are others.
bool is_compared(const FlightRecord& current, const std::deque<FlightRecord>& old_flights);

// The settings in which two flights of a launch differ, apart from method, step, kind of air and spin, which
// every row shows.
std::vector<const Field*> other_differences(const FlightRecord& a, const FlightRecord& b);

// Distance of two flights at equal times, up to the end of the shorter one.
struct FlightDistance {
  double at_end_m = 0.0;
  double largest_m = 0.0;
  double until_s = 0.0;
};
// Empty if one of them has no path yet.
std::optional<FlightDistance> distance_between(const FlightRecord& a, const FlightRecord& b);

// Path of the settings' launch in another kind of air (vacuum or drag), with the Magnus setting. It ends
// where the ball leaves the world, or after 600 points. Empty without a moving ball. Throws UserError for
// settings that cannot run.
std::vector<Vec2f> ghost_path(const Settings& settings, Air air);

struct Ghost {
  Air air = Air::vacuum;
  std::vector<Vec2f> points_m;
};
// Ghosts in vacuum and in drag, except for the settings' own kind of air.
std::vector<Ghost> ghosts_of(const Settings& settings);

}  // namespace pf
