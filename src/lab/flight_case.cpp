#include "lab/flight_case.hpp"

#include <algorithm>
#include <cmath>

#include "app/step_request.hpp"
#include "scene/derive.hpp"

namespace pf {

Settings court_settings(const CourtCase& court) {
  Settings s;  // the defaults are the court's, tests/physics/test_scenes.cpp holds them to it
  s.num_parcels = court.num_parcels;
  s.area_fraction = court.area_fraction;
  s.restitution = court.restitution;
  return s;
}

FlightResult fly_scene(const Settings& settings, double duration_s, Backend& backend) {
  const Physics physics = derive_physics(settings);
  const BallState start = initial_ball(settings);
  const Spawner spawner(settings, physics, start);
  backend.reset(physics, spawner.plan(), start);
  Settings planned = settings;  // one frame as long as the flight: its plan is the longest step that suits
  planned.time_scale = 1.0;
  planned.frame_rate_hz = 1.0 / duration_s;
  planned.substeps = 0;
  planned.max_substeps = 1'000'000'000;
  const FramePlan plan = plan_frame(planned, physics, start);
  const double dt_s = duration_s / plan.num_steps;
  const Clock::time_point begin = Clock::now();
  const StepReport report = backend.advance(step_request(settings, plan.num_steps, dt_s));
  return {report.ball, 1e6 * milliseconds_since(begin), dt_s, report.totals};
}

double speed_of(const BallState& ball) { return std::sqrt(dot(ball.velocity_mps, ball.velocity_mps)); }

}  // namespace pf
