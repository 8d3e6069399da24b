#include "app/pair_figures.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/json_number.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr std::int64_t kFramesPerFigures = 6;

json number(const std::optional<double>& value) { return value ? number_or_null(*value) : json(nullptr); }

std::optional<double> cost_of(const FrameView& flight) {
  const double time_s = flight_time_s(flight);
  if (!(time_s > 0.0) || flight.flight_record->num_steps == 0) return std::nullopt;
  return flight.flight_record->compute_ms / time_s;
}

std::optional<double> drift(double energy_j, double start_j) {
  if (!(start_j > 0.0)) return std::nullopt;
  return (energy_j - start_j) / start_j;
}

double periodic_distance_m(const FrameView& a, const FrameView& b) {
  return length(nearest_way(a.physics->world, a.ball.position_m, b.ball.position_m));
}

bool stands(const FrameView& flight) {
  return (flight.paused && flight.frame_totals.num_steps == 0) || flight.flight == Flight::landed;
}

}  // namespace

double flight_time_s(const FrameView& flight) {
  return flight.physics->ball.exists ? flight.flight_record->time_s() : flight.simulated_s;
}

void PairFigures::follow(const FrameView& first, Backend& first_backend, const FrameView& second,
                         Backend& second_backend) {
  const bool is_new = first.num_flights != num_flights_;
  if (is_new) {
    num_frames_ = 0;
    largest_m_ = 0.0;
    distance_.reset();
    halves_[0] = halves_[1] = {};
    if (num_flights_ >= 0) disturbed_ = false;
    num_flights_ = first.num_flights;
  }
  const bool both_stand = stands(first) && stands(second);
  const bool has_ended = both_stand && !both_stand_;
  both_stand_ = both_stand;
  if (both_stand && !has_ended && !is_new) return;
  if (first.physics->world.boundary == Boundary::periodic)
    largest_m_ = std::max(largest_m_, periodic_distance_m(first, second));
  if (has_ended || num_frames_ % kFramesPerFigures == 0)
    measure(first, first_backend, second, second_backend);
  ++num_frames_;
}

void PairFigures::complete(const FrameView& first, Backend& first_backend, const FrameView& second,
                           Backend& second_backend) {
  follow(first, first_backend, second, second_backend);
  measure(first, first_backend, second, second_backend);
}

void PairFigures::measure(const FrameView& first, Backend& first_backend, const FrameView& second,
                          Backend& second_backend) {
  const FrameView* flights[] = {&first, &second};
  Backend* backends[] = {&first_backend, &second_backend};
  for (std::size_t k = 0; k < 2; ++k) {
    const FrameView& flight = *flights[k];
    const bool has_ball = flight.physics->ball.exists;
    const double start_j = has_ball ? flight.flight_record->start_energy_j : start_energy_j_;
    halves_[k].time_s = flight_time_s(flight);
    halves_[k].cost_ms_per_s = cost_of(flight);
    halves_[k].energy_drift.reset();
    if (has_ball ? flight.flight_record->disturbed : disturbed_) continue;
    halves_[k].energy_drift = drift(backends[k]->measure().energy_j(), start_j);
  }
  measure_distance(first, second);
}

void PairFigures::measure_distance(const FrameView& first, const FrameView& second) {
  if (!first.physics->ball.exists || !second.physics->ball.exists) return;
  if (first.physics->world.boundary != Boundary::periodic) {
    distance_ = distance_between(*first.flight_record, *second.flight_record);
    return;
  }
  const double now_m = periodic_distance_m(first, second);
  largest_m_ = std::max(largest_m_, now_m);
  distance_ = FlightDistance{now_m, largest_m_, std::min(halves_[0].time_s, halves_[1].time_s)};
}

json PairFigures::report() const {
  const auto& [a, b] = halves_;
  const bool has_drifts = a.energy_drift && b.energy_drift;
  const bool has_costs = a.cost_ms_per_s && b.cost_ms_per_s && *a.cost_ms_per_s > 0.0;
  json distance = nullptr;
  if (distance_) distance = {{"final", distance_->at_end_m}, {"max", distance_->largest_m}};
  return {{"until_s", std::min(a.time_s, b.time_s)},
          {"distance_m", distance},
          {"energy_drift",
           {{"first", number(a.energy_drift)},
            {"second", number(b.energy_drift)},
            {"difference", has_drifts ? json(*b.energy_drift - *a.energy_drift) : json(nullptr)}}},
          {"cost_ms_per_s",
           {{"first", number(a.cost_ms_per_s)},
            {"second", number(b.cost_ms_per_s)},
            {"ratio", has_costs ? json(*b.cost_ms_per_s / *a.cost_ms_per_s) : json(nullptr)}}}};
}

}  // namespace pf
