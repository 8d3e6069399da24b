// Method `exact` on the CPU: its state between steps, stored and taken up again. Epochs, windows and kept
// events are not part of it: results do not depend on them.
#include <algorithm>

#include "backend/exact/timeline.hpp"

namespace pf {

void ExactTimeline::save(const SortedParcels& parcels, BackendState& state) const {
  const ParcelArrays& trajectories = parcels.current;
  ExactSnapshot& exact = state.exact;
  state.exact_s = time_s_;
  state.ball_was_set = ball_is_new_;
  exact.active = active_;
  exact.anchor.resize(active_ ? parcels.size() : 0);
  exact.tick.resize(exact.anchor.size());
  exact.last_contact_tick.resize(active_ ? trajectories.last_contact_tick.size() : 0);
  if (!active_) return;
  exact.now = progress_.now;
  exact.tick_exponent = progress_.tick_exponent;
  exact.ball = progress_.ball_trajectory;
  exact.ball_holds = progress_.ball_trajectory_holds;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t id = trajectories.id[i];
      exact.anchor[id] = trajectories.position[i];
      exact.tick[id] = trajectories.tick[i];
      if (!exact.last_contact_tick.empty()) exact.last_contact_tick[id] = trajectories.last_contact_tick[i];
    }
  });
}

void ExactTimeline::resume(const Physics& physics, const BackendState& state, SortedParcels& parcels) {
  const ExactSnapshot& exact = state.exact;
  time_s_ = state.exact_s;
  ball_is_new_ = state.ball_was_set;
  if (!exact.active) return;
  enter(physics, 0.0, parcels);  // the next request brings the contact duration
  ParcelArrays& trajectories = parcels.current;
  std::copy(exact.anchor.begin(), exact.anchor.end(), trajectories.position.begin());
  trajectories.tick = exact.tick;
  trajectories.last_contact_tick = exact.last_contact_tick;
  progress_.now = exact.now;
  progress_.tick_exponent = exact.tick_exponent;
  progress_.ball = state.ball;
  progress_.ball_trajectory = exact.ball;
  progress_.ball_trajectory_holds = exact.ball_holds && !state.ball_was_set;
}

}  // namespace pf
