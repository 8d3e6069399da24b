#include "app/flight.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "model/methods.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

// Position of a flight at a time, interpolated linearly between its points. at: index where the search
// starts; it is advanced.
Vec2d position_at(const FlightRecord& flight, double time_s, std::size_t& at) {
  while (at + 1 < flight.times_s.size() && flight.times_s[at + 1] < time_s) ++at;
  const Vec2d from = to_double(flight.points_m[at]);
  if (at + 1 >= flight.times_s.size()) return from;
  const double span_s = flight.times_s[at + 1] - flight.times_s[at];
  const double share = span_s > 0.0 ? std::clamp((time_s - flight.times_s[at]) / span_s, 0.0, 1.0) : 0.0;
  return from + (to_double(flight.points_m[at + 1]) - from) * share;
}

// Resolution of a path that looks smooth: points per larger side of the world, and turn per point.
constexpr double kPointsPerSide = 120.0;
constexpr double kTurnPerPoint_rad = 0.05;
constexpr std::size_t kMaxPoints = 600;

}  // namespace

const char* air_name(Air air) {
  return air == Air::vacuum ? "vacuum" : air == Air::drag ? "drag in closed form" : "";
}

const char* name_of_flight(const FlightRecord& flight) {
  return flight.air == Air::parcels ? method_name(flight.method) : air_name(flight.air);
}

std::optional<double> FlightRecord::energy_drift() const {
  if (!end_energy_j || disturbed || !(start_energy_j > 0.0)) return std::nullopt;
  return (*end_energy_j - start_energy_j) / start_energy_j;
}

const FlightRecord& reference_of(const FlightRecord& current, const std::deque<FlightRecord>& old_flights) {
  const auto find = [&](auto is_wanted) {
    const auto found = std::find_if(old_flights.rbegin(), old_flights.rend(), [&](const FlightRecord& old) {
      return old.launch == current.launch && is_wanted(old);
    });
    return found == old_flights.rend() ? &current : &*found;
  };
  const FlightRecord& first_whole = *find([](const FlightRecord& old) { return old.has_left; });
  return first_whole.has_left ? first_whole : *find([](const FlightRecord&) { return true; });
}

bool is_compared(const FlightRecord& current, const std::deque<FlightRecord>& old_flights) {
  return std::any_of(old_flights.begin(), old_flights.end(),
                     [&](const FlightRecord& old) { return old.launch == current.launch; });
}

std::vector<const Field*> other_differences(const FlightRecord& a, const FlightRecord& b) {
  static const std::vector<std::string> kTold = {
      "run.method", "run.dt_s", "run.substeps",   "run.displacement_per_step",
      "run.seed",   "air.kind", "ball.spin_radps"};
  std::vector<const Field*> different;
  for (const Field& field : fields()) {
    const bool is_told = std::find(kTold.begin(), kTold.end(), field.path()) != kTold.end();
    if (field.effects.flight && !is_told && !is_same(field, a.settings, b.settings))
      different.push_back(&field);
  }
  return different;
}

std::optional<FlightDistance> distance_between(const FlightRecord& a, const FlightRecord& b) {
  if (a.points_m.empty() || b.points_m.empty()) return std::nullopt;
  FlightDistance distance;
  distance.until_s = std::min(a.time_s(), b.time_s());
  std::size_t at_a = 0;
  std::size_t at_b = 0;
  const auto distance_at = [&](double time_s) {
    return length(position_at(a, time_s, at_a) - position_at(b, time_s, at_b));
  };
  std::vector<double> times_s;  // of the points of either: between them both paths are straight
  std::merge(a.times_s.begin(), a.times_s.end(), b.times_s.begin(), b.times_s.end(),
             std::back_inserter(times_s));
  for (const double time_s : times_s) {
    if (time_s > distance.until_s) break;
    distance.largest_m = std::max(distance.largest_m, distance_at(time_s));
  }
  distance.at_end_m = distance_at(distance.until_s);
  distance.largest_m = std::max(distance.largest_m, distance.at_end_m);
  return distance;
}

Vec2d nearest_way(const World& world, Vec2d from_m, Vec2d to_m) {
  const Vec2d way = to_m - from_m;
  if (world.boundary != Boundary::periodic) return way;
  const Vec2d half_m = to_metres(world, world.half);
  return {nearest_image(way.x, half_m.x), nearest_image(way.y, half_m.y)};
}

std::vector<Vec2f> ghost_path(const Settings& settings, Air air) {
  Settings with = settings;
  with.air = air;
  const Physics physics = derive_physics(with);
  const BallConstants& ball = physics.ball;
  BallState state = initial_ball(with);
  const double speed_mps = length(state.velocity_mps);
  if (!ball.exists || ball.held || !(speed_mps > 0.0)) return {};
  const Vec2d half_m = to_metres(physics.world, physics.world.half);
  const double turn_per_s = std::fabs(ball.magnus_per_rad * state.spin_radps);
  const double dt_s = std::min(2.0 * std::max(half_m.x, half_m.y) / (kPointsPerSide * speed_mps),
                               turn_per_s > 0.0 ? kTurnPerPoint_rad / turn_per_s : 1e30);
  std::vector<Vec2f> points = {to_float(state.position_m)};
  while (points.size() < kMaxPoints) {
    const Vec2d before = state.position_m;
    advance_ball(physics.world, ball, fly(ball, state, dt_s), {}, 0.0, state);
    if (!is_straight_way(before, state.position_m, nearest_way(physics.world, before, state.position_m)))
      break;
    points.push_back(to_float(state.position_m));
    if (has_left(physics, state)) break;
  }
  return points;
}

std::vector<Ghost> ghosts_of(const Settings& settings) {
  std::vector<Ghost> ghosts;
  for (const Air air : {Air::vacuum, Air::drag}) {
    if (air == settings.air) continue;
    std::vector<Vec2f> points_m = ghost_path(settings, air);
    if (points_m.size() > 1) ghosts.push_back({air, std::move(points_m)});
  }
  return ghosts;
}

}  // namespace pf
