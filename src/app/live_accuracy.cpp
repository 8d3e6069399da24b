#include "app/live_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/json_number.hpp"
#include "model/kinetic_theory.hpp"
#include "model/methods.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

constexpr std::chrono::milliseconds kPeriod{250};

}  // namespace

FlightKey key_of(const FrameView& view) {
  return {only(*view.settings, &Effects::flight), view.num_flights, view.num_scenes};
}

void LiveAccuracy::follow(const FrameView& view, Backend& backend, Clock::time_point now) {
  const FlightKey key = key_of(view);
  if (!start_ || start_->key != key || view.simulated_s < start_->simulated_s) {  // it may seek
    start_ = {key, backend.measure(), view.simulated_s, view.totals};
    readout_ = {};
    measured_ = now;
    measured_at_s_ = view.simulated_s;
    return;
  }
  readout_.max_overlap_diameters =
      std::max(readout_.max_overlap_diameters, view.frame_totals.max_overlap_diameters);
  if (view.mid_step || view.simulated_s == measured_at_s_ || now - measured_ < kPeriod) return;
  measured_ = now;
  measure(view, backend);
}

void LiveAccuracy::measure(const FrameView& view, Backend& backend) {
  const Measures now = backend.measure();
  const Measures& then = start_->measures;
  measured_at_s_ = view.simulated_s;
  readout_.simulated_s = view.simulated_s - start_->simulated_s;
  readout_.num_collisions = view.totals.num_collisions - start_->totals.num_collisions;
  readout_.num_retired = view.totals.num_retired - start_->totals.num_retired;
  readout_.num_retried_steps = view.totals.num_retried_steps - start_->totals.num_retried_steps;
  if (then.energy_j() > 0.0) readout_.energy_drift = now.energy_j() / then.energy_j() - 1.0;
  if (then.momentum_scale_kg_mps > 0.0) {
    readout_.momentum_drift = length(now.momentum_kg_mps - then.momentum_kg_mps) / then.momentum_scale_kg_mps;
  }
  readout_.free_flow = view.free_flow;
  const ParcelConstants& parcels = view.physics->parcels;
  if (parcels.num < 2 || !parcels.contacts || readout_.simulated_s <= 0.0) return;
  // Root of the mean square of both.
  const double speed_mps =
      std::hypot(thermal_speed_mps(parcels, now), thermal_speed_mps(parcels, then)) / std::sqrt(2.0);
  const double enskog = enskog_rate_per_s(area_fraction_of(*view.physics), speed_mps, parcels.radius_m);
  const auto num = static_cast<double>(readout_.num_collisions);
  if (enskog > 0.0 && num > 0.0) {
    readout_.rate_over_enskog = 2.0 * num / (parcels.num * readout_.simulated_s) / enskog;
    readout_.rate_error = readout_.rate_over_enskog / std::sqrt(num);
  }
  const double test_interval_s = row_of(view.settings->method).steps_per_test * view.dt_s;
  readout_.missed_fraction = missed_fraction_of_gas(speed_mps, test_interval_s, 2.0 * parcels.radius_m);
}

nlohmann::json to_json(const AccuracyReadout& r) {
  return {{"simulated_s", r.simulated_s},
          {"num_collisions", r.num_collisions},
          {"energy_drift", number_or_null(r.energy_drift)},
          {"momentum_drift", number_or_null(r.momentum_drift)},
          {"rate_over_enskog", number_or_null(r.rate_over_enskog)},
          {"rate_error", number_or_null(r.rate_error)},
          {"missed_fraction", number_or_null(r.missed_fraction)},
          {"drag_over_theory", r.free_flow ? nlohmann::json(r.free_flow->drag_over_theory) : nullptr},
          {"drag_error", r.free_flow ? nlohmann::json(r.free_flow->drag_error) : nullptr},
          {"hits_over_theory", r.free_flow ? nlohmann::json(r.free_flow->hits_over_theory) : nullptr},
          {"hits_error", r.free_flow ? nlohmann::json(r.free_flow->hits_error) : nullptr},
          {"max_overlap_diameters", r.max_overlap_diameters},
          {"num_retired", r.num_retired},
          {"num_retried_steps", r.num_retried_steps}};
}

}  // namespace pf
