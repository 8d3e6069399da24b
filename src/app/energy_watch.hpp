// Notices a gas that blows up. With long steps, or an air.impulse_scale above 1, a time-stepped method heats
// the gas. In the end parcels cross the world in a step, lie in the cells at its walls, and a step takes as
// long as all pairs.
#pragma once

#include <optional>

#include "app/live_accuracy.hpp"

namespace pf {

class EnergyWatch {
 public:
  static constexpr double kBlownUp =
      10.0;  // times the energy: nothing in a scene does that but long steps and large impulses

  // Call at the end of each frame, with its totals. Returns by what factor the energy of parcels and ball has
  // grown since parcels overlapped deeply for the first time, if that is more than kBlownUp; otherwise 0. It
  // reports that once, until the flight or its settings change. Looks at all parcels in every 30th frame with
  // deep overlaps.
  double follow(const FrameView& view, const StepTotals& frame, Backend& backend);

 private:
  struct Start {
    FlightKey key;
    double energy_j = 0.0;
    bool has_told = false;
    int num_frames = 0;  // with deep overlaps
  };

  std::optional<Start> start_;
};

}  // namespace pf
