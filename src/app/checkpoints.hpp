// Checkpoints of the current flight, kept in memory for jumps back.
#pragma once

#include <cstdint>
#include <deque>

#include "app/flight.hpp"
#include "backend/backend.hpp"

namespace pf {

struct Checkpoint {
  double shown_s = 0.0;  // frames with a step since the launch, at the frame rate
  ParcelSnapshot parcels;
  BallState ball;
  StepTotals totals;
  double simulated_s = 0.0;
  double ball_distance_m = 0.0;
  double collision_rate_per_s = 0.0;
  bool landed = false;
  FlightRecord flight;
};

class Checkpoints {
 public:
  // Keeps at most 8 checkpoints and max_bytes, at least a second apart. Large snapshots are taken less often,
  // because the picture stands still meanwhile.
  explicit Checkpoints(std::uint64_t max_bytes = 1'000'000'000) : max_bytes_(max_bytes) {}

  static std::uint64_t bytes_of(std::size_t num_parcels);
  // Number of checkpoints that fit. 0: none with so many parcels.
  std::size_t max_count(std::size_t num_parcels) const;
  bool is_due(double shown_s, std::size_t num_parcels) const;
  void keep(Checkpoint checkpoint);
  // The newest checkpoint at least half a second before shown_s, otherwise the oldest; null if there is none.
  // Drops all later ones.
  const Checkpoint* back_from(double shown_s);
  void clear() { kept_.clear(); }
  std::size_t size() const { return kept_.size(); }

 private:
  std::uint64_t max_bytes_;
  std::deque<Checkpoint> kept_;  // oldest first
};

}  // namespace pf
