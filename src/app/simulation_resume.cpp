// The state of a simulation between two frames, stored and taken up again.
#include "app/domain_checks.hpp"
#include "app/run_state.hpp"
#include "app/simulation_state.hpp"

namespace pf {

std::uint64_t state_hash(const RunState& state) {
  const ParcelSnapshot& parcels = state.backend.parcels;
  std::uint64_t hash = state.settings.ball_present ? ball_hash(state.backend.ball) : 0;
  for (std::size_t id = 0; id < parcels.position.size(); ++id)
    hash += parcel_hash(static_cast<std::uint32_t>(id), parcels.position[id], parcels.velocity[id]);
  return hash;
}

void Simulation::State::save(FlightState& to) const {
  backend->save(to.backend);
  to.settings = settings;
  to.air_seed = physics.seed;
  to.totals = view.totals;
  to.simulated_s = view.simulated_s;
  to.shown_s = shown_s;
  to.ball_distance_m = view.ball_distance_m;
  to.collision_rate_per_s = collision_rate_per_s;
  to.landed = view.flight == Flight::landed;
  to.scene_dt_s = scene_dt_s;
  to.flight = flight;
}

void Simulation::State::resume(const FlightState& from) {
  settings = from.settings;
  flight = from.flight;
  physics.seed = from.air_seed;
  physics = physics_in_flight(settings);
  backend->resume(physics, from.backend);
  ball = from.backend.ball;
  view.totals = from.totals;
  view.simulated_s = from.simulated_s;
  shown_s = from.shown_s;
  view.ball_distance_m = from.ball_distance_m;
  collision_rate_per_s = from.collision_rate_per_s;
  view.flight = from.landed ? Flight::landed : Flight::flying;
  scene_dt_s = from.scene_dt_s;
  flight.has_left = from.landed;
  profile_is_due = true;
}

void Simulation::State::save_run(RunState& to) const {
  save(to);
  to.flight_seed = flight_seed;
  to.launched_at_s = launched_at_s;
  to.landed_for_s = landed_for_s;
  to.num_launches = num_launches;
  to.num_flights = view.num_flights;
  to.last_number = last_number;
  to.left_once = left_once;
  to.by_hand = by_hand;
  to.paused = view.paused;
  to.watched = energy_watch.known(view);
}

void Simulation::State::resume_run(const RunState& from) {
  check_room(from.settings, 0);
  check_backend(from.settings, derive_physics(from.settings), *backend);
  resume(from);
  flight.settings = settings;
  ghosts = ghosts_of_flight(settings);
  flight_seed = from.flight_seed;
  launched_at_s = from.launched_at_s;
  landed_for_s = from.landed_for_s;
  num_launches = from.num_launches;
  view.num_flights = from.num_flights;
  last_number = from.last_number;
  left_once = from.left_once;
  by_hand = from.by_hand;
  view.paused = from.paused;
  free_flow.forget();
  begin_history();
  show_plan();
}

Simulation::Simulation(const RunState& from, std::unique_ptr<Backend> backend)
    : state_(std::make_unique<State>()) {
  state_->backend = std::move(backend);
  state_->resume_run(from);
  state_->update_view();
  state_->energy_watch.resume(state_->view, from.watched);
}

void Simulation::save(RunState& to) const { state_->save_run(to); }

}  // namespace pf
