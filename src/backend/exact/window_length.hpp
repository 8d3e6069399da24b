// How long windows are. Any length is right: results do not depend on it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>

#include "backend/exact/stepper.hpp"

namespace pf {

class WindowLength {
 public:
  // Tests may draw lengths instead: a function of the longest possible one, both in ticks.
  std::function<std::uint32_t(std::uint32_t)> draw;

  // num_parcels: of the scene. Forgets what was learnt.
  void reset(std::uint32_t num_parcels) {
    wanted_events_ = kEventsPerParcel * num_parcels + kMoreEvents;
    ticks_ = 1.0;
  }
  // Ticks have become longer by a power of two.
  void rescale(double factor) { ticks_ = std::max(1.0, ticks_ * factor); }

  // Length of the next window, which may be at most `limit` long. Equal parts of it.
  std::uint32_t choose(std::uint32_t limit) const {
    if (draw) return std::clamp(draw(limit), 1U, limit);
    const double parts = limit / ticks_;
    const auto num = static_cast<std::uint32_t>(parts) + (parts > 1.0 ? 1U : 0U);
    return num <= 1 ? limit : (limit + num - 1) / num;
  }

  // A window of `length` ticks was solved.
  void learn(std::uint32_t length, const WindowOutcome& outcome) {
    const auto events = static_cast<double>(outcome.result.num_events);
    const double longer = wanted_events_ / (events + 1.0);
    ticks_ = std::max(1.0, length * std::min(longer, 16.0));
  }
  // A window of `length` ticks had too many events.
  void shorten(std::uint32_t length) { ticks_ = std::max(1.0, 0.5 * length); }

 private:
  static constexpr double kEventsPerParcel = 0.1, kMoreEvents = 64.0;

  double wanted_events_ = 1.0;
  double ticks_ = 1.0;
};

}  // namespace pf
