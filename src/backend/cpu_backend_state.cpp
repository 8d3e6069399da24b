// The CPU backend's state as others read it, and going on from it.
#include <algorithm>

#include "backend/cpu_backend.hpp"

namespace pf {

ParcelSnapshot CpuBackend::snapshot() {
  ParcelSnapshot snapshot;
  take_snapshot(snapshot);
  return snapshot;
}

void CpuBackend::take_snapshot(ParcelSnapshot& snapshot) {
  snapshot.position.resize(size());
  snapshot.velocity.resize(size());
  snapshot.heated.clear();
  snapshot.step = step_;
  const std::vector<Vec2i>& position = positions();
  const ParcelArrays& parcels = parcels_.current;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, size());
    for (std::size_t i = begin; i < end; ++i) {
      snapshot.position[parcels.id[i]] = position[i];
      snapshot.velocity[parcels.id[i]] = parcels.velocity[i];
    }
  });
  for (std::size_t i = 0; i < size(); ++i) {
    if (parcels.is_heated[i] != 0) snapshot.heated.push_back(parcels.id[i]);
  }
  std::ranges::sort(snapshot.heated);
}

void CpuBackend::save(BackendState& state) {
  take_snapshot(state.parcels);
  state.ball = ball_;
  exact_.save(parcels_, state);
}

void CpuBackend::resume(const Physics& physics, const BackendState& state) {
  exact_.reset_time();
  physics_ = physics;
  restore(state.parcels);
  ball_ = state.ball;
  exact_.resume(physics_, state, parcels_);
}

}  // namespace pf
