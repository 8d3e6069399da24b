// Flights of a simulation: launches, comparisons, the path so far, and the way back.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/simulation_state.hpp"

namespace pf {
namespace {

constexpr std::size_t kMaxOldFlights = 5;
constexpr double kPauseAfterLanding_s = 1.0;

}  // namespace

void Simulation::State::launch(bool fresh_air) {
  keep_old_flight();
  ball = initial_ball(settings);
  backend->set_ball(ball);
  ++num_launches;
  begin_flight(fresh_air);
  flight.launch = num_launches;
  by_hand = false;
}

// What its parcels and ball have in the end. To be called before the air is spawned anew.
void Simulation::State::end_flight() {
  if (physics.ball.exists && flight.points_m.size() > 1 && !flight.end_energy_j)
    flight.end_energy_j = backend->measure().energy_j();
}

void Simulation::State::keep_old_flight() {
  end_flight();
  if (flight.points_m.size() > 1) old_flights.push_front(std::move(flight));
  if (old_flights.size() > kMaxOldFlights) old_flights.pop_back();
  flight = {};
}

// The ball is at its start, the air as it is to be.
void Simulation::State::begin_flight(bool fresh_air) {
  flight = {};
  flight.fresh_air = fresh_air;
  flight.air = settings.air;
  flight.method = settings.method;
  flight.set_dt_s = settings.dt_s;
  flight.speed_mps = std::hypot(settings.ball_vx_mps, settings.ball_vy_mps);
  flight.spin_radps = settings.ball_spin_radps;
  if (physics.ball.exists) flight.start_energy_j = backend->measure().energy_j();
  view.flight = Flight::flying;
  view.ball_distance_m = 0.0;
  landed_for_s = 0.0;
  shown_s = 0.0;
  if (moments) moments->clear();
  ghosts = ghosts_of(settings);
  ++view.num_flights;
  follow_ball();
}

// After a flight: the air anew and the ball at its start.
void Simulation::State::launch_again() {
  Settings with = settings;
  with.seed += num_launches;  // fresh air for each flight, the same in every run
  end_flight();
  bool fresh_air = true;
  try {
    respawn(with, initial_ball(with));
    flight_seed = with.seed;
  } catch (const UserError& error) {  // edited in flight, the air does not fit around the start
    view.message = error.what();
    fresh_air = false;
  }
  launch(fresh_air);
}

void Simulation::State::launch_again_when_due() {
  landed_for_s += 1.0 / settings.frame_rate_hz;
  if (launches_by_itself() && landed_for_s >= kPauseAfterLanding_s) launch_again();
}

// Throws UserError, and changes nothing, if it cannot be set.
void Simulation::State::fly(const BallLaunch& wanted) {
  Settings with = settings;
  with.ball_vx_mps = wanted.velocity_mps.x;
  with.ball_vy_mps = wanted.velocity_mps.y;
  with.ball_spin_radps = wanted.spin_radps;
  check_settings(with, "launch");
  end_flight();
  respawn(with, initial_ball(with));
  settings = with;
  flight_seed = settings.seed;
  launch(true);
  by_hand = true;
}

// The present launch again, in the same air. Returns false, with the reason as message, if it cannot run so.
bool Simulation::State::repeat_flight(const Settings& with) {
  Settings spawned = with;
  spawned.seed = flight_seed;
  const std::int64_t same_launch = flight.launch;
  end_flight();
  try {
    respawn(spawned, initial_ball(spawned));
  } catch (const UserError& error) {
    view.message = error.what();
    return false;
  }
  settings = with;
  keep_old_flight();
  begin_flight(true);
  flight.launch = same_launch;
  std::erase_if(old_flights, [this](const FlightRecord& old) {  // of two alike the newer stays
    return old.launch == flight.launch && old.method == flight.method && old.set_dt_s == flight.set_dt_s;
  });
  view.message.clear();
  return true;
}

void Simulation::State::compare(Comparison comparison) {
  if (!physics.ball.exists) throw UserError("compare: this scene has no ball to launch again");
  Settings with = settings;
  if (comparison == Comparison::half_step) {
    const double dt_s = settings.dt_s > 0.0 ? settings.dt_s : plan_frame(settings, physics, ball).dt_s;
    with.dt_s = 0.5 * dt_s;
    repeat_flight(with);
    return;
  }
  constexpr int kNumMethods = 3;
  for (int next = 1; next < kNumMethods; ++next) {
    with.method = static_cast<Method>((static_cast<int>(settings.method) + next) % kNumMethods);
    if (repeat_flight(with)) return;
  }
}

// A flight that was launched by hand, or is compared with another, stays to be looked at.
bool Simulation::State::launches_by_itself() const {
  const bool is_compared =
      std::any_of(old_flights.begin(), old_flights.end(),
                  [this](const FlightRecord& old) { return old.launch == flight.launch; });
  return settings.relaunch && !by_hand && !is_compared;
}

void Simulation::State::keep_moment_when_due() {
  if (!moments || !moments->is_due(shown_s, physics.parcels.num)) return;
  moments->keep({shown_s, backend->snapshot(), ball, view.totals, view.simulated_s, view.ball_distance_m,
                 collision_rate_per_s, view.flight == Flight::landed, flight});
}

// Parcels, ball, totals and path as they were then; settings stay as the person has them now.
void Simulation::State::go_back() {
  const Checkpoint* moment = moments ? moments->back_from(shown_s) : nullptr;
  if (moment == nullptr) {
    throw UserError(
        fmt::format("back: no moment is kept{}", moments && moments->most(physics.parcels.num) == 0
                                                     ? " of so many parcels; give fewer"
                                                     : " yet; let it run"));
  }
  backend->restore(moment->parcels);
  ball = moment->ball;
  backend->set_ball(ball);
  view.totals = moment->totals;
  view.simulated_s = moment->simulated_s;
  view.ball_distance_m = moment->ball_distance_m;
  view.flight = moment->landed ? Flight::landed : Flight::flying;
  collision_rate_per_s = moment->collision_rate_per_s;
  landed_for_s = 0.0;
  shown_s = moment->shown_s;
  flight = moment->flight;
  ++view.num_flights;
}

void Simulation::State::follow_ball() {
  if (!physics.ball.exists) return;
  const bool is_first = flight.points_m.empty();
  if (!is_first) {
    const Vec2d moved = ball.position_m - to_double(flight.points_m.back());
    const double length = std::sqrt(dot(moved, moved));
    const World& world = physics.world;
    const bool wrapped = world.boundary == Boundary::periodic && length > 0.5 * world.half.y * world.unit_m;
    if (!wrapped) view.ball_distance_m += length;
    if (wrapped) {
      flight.points_m.clear();
      flight.times_s.clear();
    }
  }
  if (is_first) launched_at_s = view.simulated_s;
  flight.points_m.push_back(to_float(ball.position_m));
  flight.times_s.push_back(view.simulated_s - launched_at_s);
}

}  // namespace pf
