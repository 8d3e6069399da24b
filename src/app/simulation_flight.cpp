// Flights of a simulation: launches, comparisons, and the path so far.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/simulation_state.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

constexpr std::size_t kMaxOldFlights = 5;
constexpr double kRelaunchDelay_s = 1.0;

}  // namespace

void Simulation::State::launch(bool fresh_air) {
  keep_old_flight();
  ball = initial_ball(settings);
  flight.launch_mps = ball.velocity_mps;
  const Physics launched = physics_in_flight(settings);
  if (launched.reference_speed_mps != physics.reference_speed_mps) backend->set_physics(physics = launched);
  backend->set_ball(ball);
  ++num_launches;
  begin_flight(fresh_air);
  flight.launch = num_launches;
  drop_old_flights();
  by_hand = false;
}

// Records the final energy. Call before the air is spawned anew. A flight that is shown at an earlier time is
// recorded as far as it got.
void Simulation::State::end_flight() {
  if (history.is_past() && latest_flight) flight = *latest_flight;
  if (history.is_past()) return;
  if (physics.ball.exists && flight.points_m.size() > 1 && !flight.end_energy_j)
    flight.end_energy_j = backend->measure().energy_j();
}

// Begins the record that seeks and replays go by; only what follows can be flown again.
void Simulation::State::begin_history() {
  if (checkpoints) checkpoints->clear();
  history.begin(view.simulated_s - launched_at_s);
  latest_flight.reset();
  sought.reset();
  settings_at_sought.reset();
}

// Of the same launch as the flight, which may have been changed since.
std::vector<Ghost> Simulation::State::ghosts_of_flight(Settings with) const {
  with = as_launched(std::move(with));
  if (!differ(with, flight.settings, &Effects::parcels)) {  // in another world it may not start there
    with.ball_x_m = flight.settings.ball_x_m;
    with.ball_y_m = flight.settings.ball_y_m;
  }
  if (flight.points_m.size() > 1) with.ball_spin_radps = flight.spin_radps;
  return ghosts_of(with);
}

void Simulation::State::keep_old_flight() {
  end_flight();
  if (flight.points_m.size() > 1) {
    last_number = flight.number;
    old_flights.push_front(std::move(flight));
  }
  flight = {};
}

// Drops the oldest flights, but keeps the reference of this launch.
void Simulation::State::drop_old_flights() {
  const std::int64_t kept = reference_of(flight, old_flights).number;
  while (old_flights.size() > kMaxOldFlights)
    old_flights.erase(old_flights.end() - (old_flights.back().number == kept ? 2 : 1));
}

// Starts the record of a flight. Ball and air must be in their initial state.
void Simulation::State::begin_flight(bool fresh_air) {
  flight = {};
  flight.number = last_number + 1;
  flight.fresh_air = fresh_air;
  flight.air = settings.air;
  flight.method = settings.method;
  flight.set_dt_s = settings.dt_s;
  flight.half_step = scene_dt_s.has_value();
  flight.launch_mps = initial_ball(settings).velocity_mps;
  flight.spin_radps = settings.ball_spin_radps;
  flight.settings = settings;
  if (physics.ball.exists) flight.start_energy_j = backend->measure().energy_j();
  view.flight = Flight::flying;
  view.ball_distance_m = 0.0;
  landed_for_s = 0.0;
  shown_s = 0.0;
  launched_at_s = view.simulated_s;
  begin_history();
  ghosts = ghosts_of(settings);
  ++view.num_flights;
  follow_ball();
}

// Spawns fresh air and launches the ball after a flight.
void Simulation::State::launch_again() {
  Settings with = settings;
  with.seed += num_launches;  // other air for each flight, but the same in every run
  end_flight();
  bool fresh_air = true;
  try {
    respawn(new_air(with, initial_ball(with)));
    flight_seed = with.seed;
  } catch (const UserError& error) {  // settings changed in flight may leave no room around the start
    view.message = error.what();
    fresh_air = false;
  }
  launch(fresh_air);
}

void Simulation::State::launch_again_when_due() {
  landed_for_s += 1.0 / settings.frame_rate_hz;
  if (launches_by_itself() && landed_for_s >= kRelaunchDelay_s) launch_again();
}

// Throws UserError, without any change, for a launch out of range or air that does not fit.
void Simulation::State::fly(const BallLaunch& wanted) {
  Settings with = settings;
  with.ball_vx_mps = wanted.velocity_mps.x;
  with.ball_vy_mps = wanted.velocity_mps.y;
  with.ball_spin_radps = wanted.spin_radps;
  check_settings(with, "launch");
  const NewAir air = new_air(with, initial_ball(with));
  end_flight();
  respawn(air);
  settings = with;
  flight_seed = settings.seed;
  launch(true);
  by_hand = true;
}

// Repeats the current launch in the same air. Returns false, with the reason as message, if it cannot run.
bool Simulation::State::repeat_flight(const Settings& with) {
  Settings spawned = with;
  spawned.seed = flight_seed;
  const BallState start = initial_ball(with);
  const bool is_same =
      start.velocity_mps == flight.launch_mps && start.position_m == initial_ball(flight.settings).position_m;
  const std::int64_t launch_number = is_same ? flight.launch : ++num_launches;
  std::optional<NewAir> air;
  try {
    air.emplace(new_air(spawned, initial_ball(spawned)));
  } catch (const UserError& error) {
    view.message = error.what();
    return false;
  }
  end_flight();
  respawn(*air);
  settings = with;
  keep_old_flight();
  begin_flight(true);
  flight.launch = launch_number;
  const std::int64_t kept = reference_of(flight, old_flights).number;
  std::erase_if(old_flights, [&](const FlightRecord& old) {  // keeps the newer of two equal ones
    const bool is_equal = old.launch == flight.launch && old.method == flight.method &&
                          old.set_dt_s == flight.set_dt_s && old.spin_radps == flight.spin_radps &&
                          other_differences(old, flight).empty();
    return is_equal && old.number != kept;
  });
  drop_old_flights();
  view.message.clear();
  return true;
}

void Simulation::State::compare(Comparison comparison, std::optional<Method> logged) {
  if (!physics.ball.exists) throw UserError("compare: this scene has no ball to launch again");
  if (comparison == Comparison::next_method) return compare_methods(logged);
  compare_steps(comparison == Comparison::half_step);
}

double Simulation::State::half_step_of(const Settings& with) const {
  return 0.5 * (with.dt_s > 0.0 ? with.dt_s : plan_frame(with, derive_physics(with), ball).dt_s);
}

// Repeats the launch with half of the step, or with the scene's.
void Simulation::State::compare_steps(bool half) {
  if (!half && !scene_dt_s) return;
  const std::optional<double> before_s = scene_dt_s;
  Settings with = settings;
  if (half) {
    scene_dt_s = scene_dt_s.value_or(settings.dt_s);
    with.dt_s = half_step_of(settings);
  } else {
    with.dt_s = *scene_dt_s;
    scene_dt_s.reset();
  }
  if (!repeat_flight(with)) scene_dt_s = before_s;
}

// logged: the method in the log, which may come from a backend that lacks some methods.
void Simulation::State::compare_methods(std::optional<Method> logged) {
  Settings with = settings;
  for (const Method next : methods_after(settings.method)) {
    with.method = next;
    if (logged.value_or(with.method) == with.method && repeat_flight(with)) return;
  }
}

// False after a launch by hand or a comparison, so that the user can look at the flight.
bool Simulation::State::launches_by_itself() const {
  return settings.relaunch && !by_hand && !is_compared(flight, old_flights);
}

void Simulation::State::follow_ball() {
  if (!physics.ball.exists) return;
  const bool is_first = flight.points_m.empty();
  if (!is_first) {
    const Vec2d before = to_double(flight.points_m.back());
    const Vec2d moved = nearest_way(physics.world, before, ball.position_m);
    view.ball_distance_m += length(moved);
    if (!is_straight_way(before, ball.position_m, moved)) {
      flight.points_m.clear();
      flight.times_s.clear();
    }
  }
  flight.points_m.push_back(to_float(ball.position_m));
  flight.times_s.push_back(view.simulated_s - launched_at_s);
}

}  // namespace pf
