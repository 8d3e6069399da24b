// Notices a gas that blows up. With long steps, or an air.impulse_scale above 1, a time-stepped method heats
// the gas. In the end parcels cross the world in a step, lie in the cells at its walls, and a step takes as
// long as all pairs.
#pragma once

#include <optional>

#include "app/live_accuracy.hpp"
#include "app/run_state.hpp"

namespace pf {

class EnergyWatch {
 public:
  static constexpr double kBlownUp =
      10.0;  // times the energy: nothing in a scene does that but long steps and large impulses

  // Call before the steps of each frame. Looks at all parcels where a flight begins or its settings change.
  void begin_frame(const FrameView& view, Backend& backend);
  // Call at the end of each frame. Returns by what factor the energy of parcels and ball has grown since the
  // flight began, or its settings changed, if that is more than kBlownUp; otherwise 0. It reports that once.
  // Looks at all parcels in every 30th frame.
  double end_frame(const FrameView& view, Backend& backend);

  // What is known of the flight between two frames, and the same in a flight that goes on from there.
  WatchedEnergy known(const FrameView& view) const;
  void resume(const FrameView& view, const WatchedEnergy& known);

 private:
  static bool may_blow_up(const FrameView& view);

  struct Start {
    FlightKey key;
    double energy_j = 0.0;
    bool has_told = false;
    std::int64_t num_frames = 0;
  };

  std::optional<Start> start_;
};

}  // namespace pf
