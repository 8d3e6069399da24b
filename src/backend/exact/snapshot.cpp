#include "backend/exact/snapshot.hpp"

#include <algorithm>

#include "backend/exact/timeline.hpp"

namespace pf {

ExactSnapshot ExactTimeline::snapshot(const SortedParcels& parcels) const {
  ExactSnapshot kept;
  kept.ball_is_new = ball_is_new_;
  kept.time_s = time_s_;
  kept.active = active_;
  if (!active_) return kept;
  kept.run = run_;
  kept.progress = progress_;
  const ParcelArrays& now = parcels.current;
  const bool has_contact_ticks = !now.last_contact_tick.empty();
  kept.anchor.resize(parcels.size());
  kept.tick.resize(parcels.size());
  if (has_contact_ticks) kept.last_contact_tick.resize(parcels.size());
  for (std::size_t i = 0; i < parcels.size(); ++i) {
    const std::uint32_t id = now.id[i];
    kept.anchor[id] = now.position[i];
    kept.tick[id] = now.tick[i];
    if (has_contact_ticks) kept.last_contact_tick[id] = now.last_contact_tick[i];
  }
  return kept;
}

void ExactTimeline::restore(const ExactSnapshot& snapshot, SortedParcels& parcels) {
  ball_is_new_ = snapshot.ball_is_new;
  time_s_ = snapshot.time_s;
  is_mid_step_ = false;
  active_ = snapshot.active;
  forget_predictions();
  if (!active_) return;
  run_ = snapshot.run;
  progress_ = snapshot.progress;
  ParcelArrays& trajectories = parcels.current;
  std::copy(snapshot.anchor.begin(), snapshot.anchor.end(), trajectories.position.begin());
  trajectories.tick = snapshot.tick;
  trajectories.last_contact_tick = snapshot.last_contact_tick;
  parcels.sorted = false;
  position_.resize(trajectories.position.size());
  present_is_valid_ = false;
  window_length_.reset(static_cast<std::uint32_t>(parcels.size()));
}

}  // namespace pf
