// Scenes of the lab, built in code, and a backend that runs one.
#pragma once

#include <cmath>
#include <memory>
#include <random>

#include "app/step_request.hpp"
#include "backend/backend.hpp"
#include "scene/derive.hpp"

namespace pf {

// A periodic square of n parcels of unit diameter, mass and speed per component; no ball.
inline Settings unit_gas(std::int64_t n, double area_fraction, Method method) {
  Settings s;
  s.name = "gas";
  s.width_m = s.height_m = 1.0;
  s.boundary = Boundary::periodic;
  s.box_follows_parcels = true;
  s.num_parcels = n;
  s.area_fraction = area_fraction;
  s.parcel_radius_m = 0.5;
  s.parcel_mass_kg = 1.0;
  s.restitution = 1.0;
  s.ball_present = false;
  s.method = method;
  return s;
}

struct LabRun {
  Settings settings;
  Physics physics;
  BallState ball;
  std::unique_ptr<Backend> backend;

  LabRun(const Settings& s, unsigned threads) : settings(s), backend(make_cpu_backend(threads)) {
    physics = derive_physics(settings);
    ball = initial_ball(settings);
    const Spawner spawner(settings, physics, ball);
    backend->reset(physics, spawner.plan(), ball);
  }

  StepReport advance(std::uint32_t steps, double dt_s) {
    return backend->advance(step_request(settings, steps, dt_s));
  }
};

// Mean of equally weighted samples and its standard error from their scatter.
class Mean {
 public:
  void add(double x) {
    sum_ += x;
    sum2_ += x * x;
    ++num_;
  }
  double value() const { return sum_ / num_; }
  double error() const {
    const double variance = sum2_ / num_ - value() * value();
    return num_ > 1 ? std::sqrt(std::max(0.0, variance) / (num_ - 1)) : 0.0;
  }

 private:
  double sum_ = 0.0, sum2_ = 0.0;
  int num_ = 0;
};

// Uniform in [0, 1).
inline double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

}  // namespace pf
