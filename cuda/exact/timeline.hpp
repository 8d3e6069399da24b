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
  // Stops being active; the caller stores the positions.
  void leave() { is_active_ = false; }
  // Ticks of the reference speed at which the steps of a request end, in order; only every num_together-th and
  // the last. Moves the time to the last one. Steps shorter than a tick may have none. tick_s: of the reference
  // speed.
  std::vector<std::uint64_t> plan_ends(const StepRequest& request, std::uint32_t num_together, double tick_s);

 private:
  bool is_active_ = false;
  double time_s_ = 0.0;    // requested since the reset
  std::uint64_t now_ = 0;  // its nearest tick of the reference speed
};

}  // namespace pf::cuda
