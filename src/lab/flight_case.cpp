#include "lab/flight_case.hpp"

#include <algorithm>
#include <cmath>

#include "app/scene_run.hpp"
#include "app/step_request.hpp"
#include "core/error.hpp"
#include "scene/derive.hpp"

namespace pf {

Settings court_settings(const CourtCase& court) {
  Settings s;  // the defaults are the court's: tests/physics/test_scenes.cpp checks it
  s.num_parcels = court.num_parcels;
  s.area_fraction = court.area_fraction;
  s.restitution = court.restitution;
  return s;
}

namespace {

// Plans steps as if a frame lasted duration_s: the longest step that suits the scene.
FramePlan plan_duration(Settings settings, const Physics& physics, const BallState& start,
                        double duration_s) {
  settings.time_scale = 1.0;
  settings.frame_rate_hz = 1.0 / duration_s;
  settings.substeps = 0;
  settings.max_substeps = 1'000'000'000;
  return plan_frame(settings, physics, start);
}

// Share of the way from a to b at which it crosses the edge of the world; above 1 if it does not.
double share_to_edge(const World& world, Vec2d a, Vec2d b) {
  const Vec2d half = to_metres(world, world.half);
  const auto along = [](double from, double to, double edge) {
    return std::fabs(to) > edge ? (std::copysign(edge, to) - from) / (to - from) : 2.0;
  };
  return std::min(along(a.x, b.x, half.x), along(a.y, b.y, half.y));
}

}  // namespace

FlightResult fly_scene(const Settings& settings, double duration_s, Backend& backend) {
  const auto [physics, start] = spawn_scene(settings, backend);
  const FramePlan plan = plan_duration(settings, physics, start, duration_s);
  const double dt_s = duration_s / plan.num_steps;
  const Clock::time_point start_time = Clock::now();
  const StepReport report = backend.advance(step_request(settings, physics, plan.num_steps, dt_s));
  return {report.ball, 1e6 * milliseconds_since(start_time), dt_s, report.totals};
}

Exit fly_to_exit(const Settings& settings, Backend& backend) {
  constexpr double kPart_s = 0.01, kMaxFlight_s = 10.0;
  const auto [physics, start] = spawn_scene(settings, backend);
  BallState ball = start;
  Exit exit;
  while (exit.time_s < kMaxFlight_s) {
    const FramePlan plan = plan_duration(settings, physics, ball, kPart_s);
    const Clock::time_point start_time = Clock::now();
    const BallState next =
        backend.advance(step_request(settings, physics, plan.num_steps, kPart_s / plan.num_steps)).ball;
    exit.wall_ns += 1e6 * milliseconds_since(start_time);
    const Vec2d moved = next.position_m - ball.position_m;
    const double to_edge = share_to_edge(physics.world, ball.position_m, next.position_m);
    const double share = std::min(1.0, to_edge);
    exit.at_m = ball.position_m + moved * share;
    exit.speed_mps = speed_of(ball) + (speed_of(next) - speed_of(ball)) * share;
    exit.time_s += kPart_s * share;
    exit.path_m += length(moved) * share;
    if (to_edge <= 1.0) return exit;
    ball = next;
  }
  throw UserError("lab: the ball of scene " + settings.name +
                  " does not leave the world within 10 s; give another scene");
}

FlightFrames fly_frames(const Settings& settings, double max_time_s, double max_wall_s, Backend& backend) {
  const auto [physics, start] = spawn_scene(settings, backend);
  FlightFrames flight;
  flight.ball = start;
  double wall_s = 0.0, rate_per_s = 0.0;
  try {
    while (flight.time_s < max_time_s && wall_s < max_wall_s && !has_left(physics, flight.ball)) {
      const FramePlan plan = plan_frame(settings, physics, flight.ball, rate_per_s);
      const Clock::time_point start_time = Clock::now();
      const StepReport report = backend.advance(step_request(settings, physics, plan.num_steps, plan.dt_s));
      flight.frame_ms.push_back(milliseconds_since(start_time));
      wall_s += 1e-3 * flight.frame_ms.back();
      rate_per_s = measured_rate_per_s(report.totals.num_collisions, physics.parcels.num, plan);
      flight.time_s += plan.num_steps * plan.dt_s;
      flight.totals += report.totals;
      flight.ball = report.ball;
    }
  } catch (const UserError&) {
    flight.refused = true;
  }
  return flight;
}

double speed_of(const BallState& ball) { return length(ball.velocity_mps); }

}  // namespace pf
