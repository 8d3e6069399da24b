// How accurate the run is while it runs: drift of what is conserved, collisions against theory, overlaps.
#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "app/simulation.hpp"

namespace pf {

// Since the last change of flight or settings. Not a number: has no meaning here, or nothing happened yet.
struct AccuracyReadout {
  static constexpr double kInvalidIndex = std::numeric_limits<double>::quiet_NaN();

  double simulated_s = 0.0;          // that the figures are over
  std::uint64_t num_collisions = 0;  // of pairs
  double energy_drift = kInvalidIndex;       // relative, parcels and ball; with e < 1 the loss is physics
  double momentum_drift = kInvalidIndex;     // relative to the sum of |m v|; walls and a held ball take some
  double rate_over_enskog = kInvalidIndex;   // collision rate over Enskog's
  double rate_error = kInvalidIndex;         // its standard error, from the number of collisions
  double missed_fraction = kInvalidIndex;    // share of collisions that steps so long do not see, by theory; 0: exact
  double max_overlap_diameters = 0.0;
  std::uint64_t num_retired = 0;       // parcels that left an open world
  std::uint64_t num_retried_steps = 0;  // of method exact
};

// Measuring takes a pass over all parcels: it is done four times a second, and only while somebody looks.
class LiveAccuracy {
 public:
  // After each frame's steps, without gaps.
  void follow(const FrameView& view, Backend& backend);
  void forget() { begin_.reset(); }  // nobody looks: the next frame begins anew
  const AccuracyReadout& readout() const { return readout_; }
  bool is_followed() const { return begin_.has_value(); }

 private:
  struct Begin {
    Settings settings;  // as far as they matter
    std::int64_t num_flights = 0;
    std::int64_t num_scenes = 0;
    Measures measures;
    double simulated_s = 0.0;
    StepTotals totals;
  };

  void measure(const FrameView& view, Backend& backend);

  std::optional<Begin> begin_;
  AccuracyReadout readout_;
  Clock::time_point measured_;
  double measured_at_s_ = 0.0;  // simulated
};

// Keys: the members of AccuracyReadout; null for what is not a number.
nlohmann::json to_json(const AccuracyReadout& readout);

}  // namespace pf
