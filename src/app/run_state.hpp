// The state of a run between two frames: what a file keeps so that the run goes on to the same bits. Earlier
// flights that are still shown are not part of it.
#pragma once

#include <cstdint>
#include <optional>

#include "app/flight.hpp"
#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

// The part that a jump within the flight restores, too.
struct FlightState {
  Settings settings;           // with the number of parcels for the backend
  std::uint64_t air_seed = 0;  // of the spawned air, and of the random roundings
  BackendState backend;
  StepTotals totals;
  double simulated_s = 0.0;
  double shown_s = 0.0;  // frames with a step since the launch, at the frame rate
  double ball_distance_m = 0.0;
  double collision_rate_per_s = 0.0;
  bool landed = false;
  std::optional<double> scene_dt_s;  // before a comparison halved it
  FlightRecord flight;
};

// What EnergyWatch knows of the flight.
struct WatchedEnergy {
  std::optional<double> start_j;  // none: no frame was watched
  std::int64_t num_frames = 0;
  bool has_told = false;
};

struct RunState : FlightState {
  std::int64_t flight_seed = 0;
  double launched_at_s = 0.0;
  double landed_for_s = 0.0;
  std::int64_t num_launches = 0;
  std::int64_t num_flights = 0;
  std::int64_t last_number = 0;
  bool left_once = false;
  bool by_hand = false;
  bool paused = false;
  WatchedEnergy watched;
  // State of the run around the simulation.
  Measures initial;
  std::int64_t num_frames = 0;
  std::int64_t frames_after_flight = 0;
};

// The hash of the state, as Backend::state_hash gives it.
std::uint64_t state_hash(const RunState& state);

}  // namespace pf
