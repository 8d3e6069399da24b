#include "app/energy_watch.hpp"

namespace pf {

double EnergyWatch::follow(const FrameView& view, const StepTotals& frame, Backend& backend) {
  constexpr double kDeep = 0.3;                                               // overlap, diameters
  constexpr int kFrames = 30;                                                 // from one look to the next
  const bool is_held = view.physics->ball.exists && view.physics->ball.held;  // it may drive the gas
  if (frame.max_overlap_diameters < kDeep || is_held || view.mid_step) return 0.0;
  const FlightKey key = key_of(view);
  if (!start_ || start_->key != key) {
    start_ = {key, backend.measure().energy_j()};
    return 0.0;
  }
  if (start_->has_told || ++start_->num_frames % kFrames != 0) return 0.0;
  const double growth = backend.measure().energy_j() / start_->energy_j;
  start_->has_told = growth > kBlownUp;
  return start_->has_told ? growth : 0.0;
}

}  // namespace pf
