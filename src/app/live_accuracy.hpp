// Accuracy of a run while it runs: drift of conserved quantities, collisions against theory, overlaps.
#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "app/free_flow_watch.hpp"
#include "app/simulation.hpp"

namespace pf {

// Figures since the last change of flight or settings. NaN: not applicable, or no data yet.
struct AccuracyReadout {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double simulated_s = 0.0;            // duration of the measurement
  std::uint64_t num_collisions = 0;    // of pairs
  double energy_drift = kUnknown;      // relative, parcels and ball; with restitution < 1 the loss is physics
  double momentum_drift = kUnknown;    // relative to the sum of |m v|; walls and a held ball take some
  double rate_over_enskog = kUnknown;  // collision rate over Enskog's
  double rate_error = kUnknown;        // its standard error, from the number of collisions
  double missed_fraction = kUnknown;   // share of collisions that the step misses, by theory; 0: exact
  std::optional<FreeFlowFigures> free_flow;  // since parcels were spawned
  double max_overlap_diameters = 0.0;
  std::uint64_t num_retired = 0;        // parcels that left an open world
  std::uint64_t num_retried_steps = 0;  // of method exact
};

// Identifies a flight with unchanged settings. The figures restart when it changes.
struct FlightKey {
  Settings settings;  // those that affect the flight
  std::int64_t num_flights = 0;
  std::int64_t num_scenes = 0;
  bool operator==(const FlightKey&) const = default;
};
FlightKey key_of(const FrameView& view);

// Measures four times a second, since a measurement is a pass over all parcels, and only while the figures
// are shown.
class LiveAccuracy {
 public:
  // Call after the steps of each frame while the figures are shown. now: when that is.
  void follow(const FrameView& view, Backend& backend, Clock::time_point now);
  void forget() { start_.reset(); }  // the figures are no longer shown; the next frame starts anew
  const AccuracyReadout& readout() const { return readout_; }
  bool is_followed() const { return start_.has_value(); }

 private:
  struct Start {
    FlightKey key;
    Measures measures;
    double simulated_s = 0.0;
    StepTotals totals;
  };

  void measure(const FrameView& view, Backend& backend);

  std::optional<Start> start_;
  AccuracyReadout readout_;
  Clock::time_point measured_;
  double measured_at_s_ = 0.0;  // simulated
};

// Keys: the members, and those of free_flow. null for NaN, and for figures that there are none of.
nlohmann::json to_json(const AccuracyReadout& readout);

}  // namespace pf
