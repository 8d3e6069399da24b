// Checkpoints of the current flight that are kept in memory: it can be flown again from each.
#pragma once

#include <cstdint>
#include <deque>

#include "app/run_state.hpp"

namespace pf {

struct Checkpoint : FlightState {
  std::int64_t frame = 0;       // of FlightHistory
  std::size_t num_changes = 0;  // of the settings, made until then
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
  // Drops checkpoints after a frame, and one at that frame taken after later changes of settings.
  void drop_after(std::int64_t frame, std::size_t num_changes);
  // Keeps no more of them until clear(), for lack of memory.
  void stop() { is_stopped_ = true; }
  void clear() {
    kept_.clear();
    is_stopped_ = false;
  }
  std::size_t size() const { return kept_.size(); }
  const std::deque<Checkpoint>& kept() const { return kept_; }  // oldest first

 private:
  void thin_out();

  std::uint64_t max_bytes_;
  bool is_stopped_ = false;
  std::deque<Checkpoint> kept_;
};

}  // namespace pf
