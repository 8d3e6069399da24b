// The differences between two flights of the same launch: distance of the balls, energy, and cost.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "app/simulation.hpp"

namespace pf {

// Simulated time of the current flight: since the launch, or since the start if there is no ball.
double flight_time_s(const FrameView& flight);

// A flight's part of the comparison.
struct HalfFigures {
  double time_s = 0.0;                 // of the flight
  std::optional<double> energy_drift;  // relative to its start, of parcels and ball
  // Computing time per simulated second since the launch. The two flights compute one after the other, never
  // at the same time, and take turns in going first.
  std::optional<double> cost_ms_per_s;
};

// All figures are of one moment, ten times a second at 60 frames.
class PairFigures {
 public:
  PairFigures() = default;
  // start: measures of either flight; both start with the same parcels.
  explicit PairFigures(const Measures& start) : start_energy_j_(start.energy_j()) {}

  // A setting was changed in a flight without a ball: no energy drift until the next start.
  void disturb() { disturbed_ = true; }
  // After each frame that both have done.
  void follow(const FrameView& first, Backend& first_backend, const FrameView& second,
              Backend& second_backend);
  // As follow(), with all figures of this moment.
  void complete(const FrameView& first, Backend& first_backend, const FrameView& second,
                Backend& second_backend);

  const HalfFigures& first() const { return halves_[0]; }
  const HalfFigures& second() const { return halves_[1]; }
  // Distance of the balls at the same time: at the end of the shorter flight, and the largest until then.
  // None without balls.
  const std::optional<FlightDistance>& distance() const { return distance_; }

  // Keys: until_s, distance_m.{final,max}, energy_drift.{first,second,difference},
  // cost_ms_per_s.{first,second,ratio}; null where a figure is not known.
  nlohmann::json report() const;

 private:
  void measure(const FrameView& first, Backend& first_backend, const FrameView& second,
               Backend& second_backend);
  void measure_distance(const FrameView& first, const FrameView& second);

  HalfFigures halves_[2];
  double start_energy_j_ = 0.0;  // of scenes without a ball
  bool disturbed_ = false;
  std::optional<FlightDistance> distance_;
  double largest_m_ = 0.0;  // in a periodic world
  std::int64_t num_frames_ = 0;
  std::int64_t num_flights_ = -1;
  bool both_stand_ = false;
};

}  // namespace pf
