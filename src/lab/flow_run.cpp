#include "lab/flow_run.hpp"

#include <algorithm>
#include <cmath>

#include "app/step_request.hpp"
#include "core/timing.hpp"
#include "lab/theory.hpp"

namespace pf {
namespace {

// Mean 0 and <v^2> = 2 exactly, so that the temperature of a start has no scatter.
void normalise(std::vector<Vec2f>& velocities) {
  Vec2d mean;
  for (const Vec2f& v : velocities) mean += to_double(v);
  mean = mean * (1.0 / static_cast<double>(velocities.size()));
  double square = 0.0;
  for (const Vec2f& v : velocities) square += dot(to_double(v) - mean, to_double(v) - mean);
  const double scale = std::sqrt(2.0 * static_cast<double>(velocities.size()) / square);
  for (Vec2f& v : velocities) v = to_float((to_double(v) - mean) * scale);
}

// Time until the lattice of the start is forgotten: some collisions per parcel, or in a thin gas a flight
// over many sites.
double equilibration(double area_fraction, double rate) {
  const double spacing = std::sqrt(0.25 * kPi / area_fraction);
  if (area_fraction < 1e-3) return std::min(4.0 / rate, 20.0 * spacing);
  return (area_fraction < 0.03 ? 4.0 : 12.0) / rate;
}

}  // namespace

FlowRun::FlowRun(const Settings& settings, const FlowSteps& steps, Backend& backend)
    : settings_(settings), steps_(steps), backend_(backend) {
  settings_.restitution = 1.0;
  settings_.method = Method::exact;
  physics_ = spawn_scene(settings_, backend_).physics;
  const double rate = theory::collision_rate_per_s(settings.area_fraction, 1.0, physics_.parcels.radius_m);
  if (settings.contacts) {
    const double duration = equilibration(settings.area_fraction, rate);
    const auto num = static_cast<std::uint32_t>(std::max(1.0, std::ceil(10.0 * duration * rate)));
    backend_.advance(step_request(settings_, physics_, num, duration / num));
  }
  start_ = backend_.snapshot();
  normalise(start_.velocity);
  settings_.method = steps.method;
  settings_.restitution = steps.restitution;
}

void FlowRun::rescale(const FlowScales& scales) {
  const double by_displacement = steps_.displacement * 2.0 * physics_.parcels.radius_m / scales.fastest;
  const double by_rate = 0.1 / scales.hottest_rate;
  max_dt_ = steps_.displacement > 0.0 ? by_displacement : by_rate;
}

void FlowRun::begin(const FlowScales& scales) {
  rescale(scales);
  physics_.reference_speed_mps = scales.reference;
  physics_.parcels.restitution = steps_.restitution;
  backend_.set_physics(physics_);
  backend_.restore(start_);
}

StepReport FlowRun::advance(double duration) {
  const auto num = static_cast<std::uint32_t>(std::max(1.0, std::ceil(duration / max_dt_)));
  const Clock::time_point start = Clock::now();
  StepReport report = backend_.advance(step_request(settings_, physics_, num, duration / num));
  wall_ns_ += 1e6 * milliseconds_since(start);
  totals_ += report.totals;
  return report;
}

}  // namespace pf
