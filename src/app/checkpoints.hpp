// Checkpoints of the current flight that are kept in memory: it can be flown again from each.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "app/flight.hpp"
#include "backend/backend.hpp"

namespace pf {

struct Checkpoint {
  std::int64_t frame = 0;       // of FlightHistory
  std::size_t num_changes = 0;  // of the settings, made until then
  double shown_s = 0.0;         // frames with a step since the launch, at the frame rate
  Settings settings;
  Physics physics;                   // its seed is that of the air
  std::optional<double> scene_dt_s;  // before a comparison halved it
  BackendState backend;
  StepTotals totals;
  double simulated_s = 0.0;
  double ball_distance_m = 0.0;
  double collision_rate_per_s = 0.0;
  bool landed = false;
  FlightRecord flight;
};

class Checkpoints {
 public:
  // Keeps at most 16 checkpoints and max_bytes, at least a second apart. Large snapshots are taken less
  // often, because the picture stands still meanwhile. The first one stays; where there are too many, those
  // that are nearest to each other go.
  explicit Checkpoints(std::uint64_t max_bytes = 1'000'000'000) : max_bytes_(max_bytes) {}

  static std::uint64_t bytes_of(std::size_t num_parcels);
  // Number of checkpoints that fit. 0: none with so many parcels.
  std::size_t max_count(std::size_t num_parcels) const;
  bool is_due(double shown_s, std::size_t num_parcels) const;
  void keep(Checkpoint checkpoint);
  // The newest one at or before a frame; null: none.
  const Checkpoint* newest_until(std::int64_t frame) const;
  // Forgets those after a frame, and one at it with later changes of the settings.
  void drop_after(std::int64_t frame, std::size_t num_changes);
  void clear() { kept_.clear(); }
  std::size_t size() const { return kept_.size(); }
  const std::deque<Checkpoint>& kept() const { return kept_; }  // oldest first

 private:
  void thin_out();

  std::uint64_t max_bytes_;
  std::deque<Checkpoint> kept_;
};

}  // namespace pf
