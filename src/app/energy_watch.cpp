#include "app/energy_watch.hpp"

namespace pf {

// A ball that is held may drive the gas.
bool EnergyWatch::may_blow_up(const FrameView& view) {
  const bool is_held = view.physics->ball.exists && view.physics->ball.held;
  return !is_held && view.settings->method != Method::exact && view.physics->parcels.num > 0;
}

void EnergyWatch::begin_frame(const FrameView& view, Backend& backend) {
  if (!may_blow_up(view)) return;
  const FlightKey key = key_of(view);
  if (!start_ || start_->key != key) start_ = {key, backend.measure().energy_j()};
}

double EnergyWatch::end_frame(const FrameView& view, Backend& backend) {
  constexpr int kFrames = 30;  // from one look to the next
  if (!may_blow_up(view) || view.mid_step || !start_) return 0.0;
  if (start_->has_told || ++start_->num_frames % kFrames != 0) return 0.0;
  const double growth = backend.measure().energy_j() / start_->energy_j;
  start_->has_told = growth > kBlownUp;
  return start_->has_told ? growth : 0.0;
}

WatchedEnergy EnergyWatch::known(const FrameView& view) const {
  if (!start_ || start_->key != key_of(view)) return {};
  return {start_->energy_j, start_->num_frames, start_->has_told};
}

void EnergyWatch::resume(const FrameView& view, const WatchedEnergy& known) {
  start_.reset();
  if (known.start_j) start_ = {key_of(view), *known.start_j, known.has_told, known.num_frames};
}

}  // namespace pf
