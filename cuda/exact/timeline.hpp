// Method `exact` on the CUDA backend from request to request: the time, and whether the stored positions are
// anchors. Within a request steps follow each other on the device (timeline.cuh).
#pragma once

#include <cstdint>
#include <vector>

#include "backend/backend.hpp"
#include "cuda/exact/kernels.cuh"

namespace pf::cuda {

class ExactTimeline {
 public:
  // While active, the parcels' stored positions are anchors of trajectories, and StepMemory::positions has
  // the current ones.
  bool active() const { return is_active_; }
  void reset_time();
  // Becomes active: anchors every parcel at its position.
  void enter(const ExactLaunch& launch, cudaStream_t stream);
  // Seconds of completed steps since the reset.
  double time_s() const { return time_s_; }
  // Goes on from a saved time, after reset_time(); before enter(), if trajectories follow.
  void set_time(double time_s) { time_s_ = time_s; }
  // Goes on from a saved tick of the reference speed, after enter().
  void set_now(std::uint64_t now) { now_ = now; }
  // Stops being active; the caller stores the positions.
  void leave() { is_active_ = is_mid_step_ = false; }
  // Ends of the steps of a request. Steps shorter than a tick may have no end. tick_s: of the reference
  // speed.
  struct End {
    std::uint64_t tick;       // of the reference speed
    std::uint32_t num_steps;  // of the request, up to here
  };
  const std::vector<End>& plan_ends(const StepRequest& request, double tick_s);
  // Moves the time to where the request has come: a tick of the reference speed. Returns the number of its
  // steps that are complete.
  std::uint32_t finish(std::uint64_t now);
  // The last request ended within a step, which the next one completes.
  bool is_mid_step() const { return is_mid_step_; }

 private:
  bool is_active_ = false;
  bool is_mid_step_ = false;
  double time_s_ = 0.0;          // of completed steps since the reset
  double series_start_s_ = 0.0;  // time at the start of the series of requests
  std::uint64_t now_ = 0;        // tick of the reference speed
  StepRequest request_;
  std::vector<End> ends_;  // of the request
};

}  // namespace pf::cuda
