// Moments of the present flight, kept in memory so that one can jump back to them.
#pragma once

#include <cstdint>
#include <deque>

#include "app/flight.hpp"
#include "backend/backend.hpp"

namespace pf {

struct Checkpoint {
  double shown_s = 0.0;  // on the clock of the frames that moved, since the launch
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
  // At most 8 moments, most_bytes in all, a second apart or more: a snapshot of many parcels stops the
  // picture for as long as it takes, so they come the rarer the larger they are.
  explicit Checkpoints(std::uint64_t max_bytes = 1'000'000'000) : max_bytes_(max_bytes) {}

  static std::uint64_t bytes_of(std::size_t num_parcels);
  // How many fit; 0: jumping back cannot be had for so many parcels.
  std::size_t most(std::size_t num_parcels) const;
  bool is_due(double shown_s, std::size_t num_parcels) const;
  void keep(Checkpoint moment);
  // The newest moment that lies half a second or more before shown_s, else the oldest; null if there is none.
  // Those after it are forgotten.
  const Checkpoint* back_from(double shown_s);
  void clear() { kept_.clear(); }
  std::size_t size() const { return kept_.size(); }

 private:
  std::uint64_t max_bytes_;
  std::deque<Checkpoint> kept_;  // oldest first
};

}  // namespace pf
