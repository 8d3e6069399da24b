// Chooses the length of windows. Any length is right: results do not depend on it.
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
  std::uint32_t event_limit = 0;  // as max_cluster_events; 0: the rule's own

  // num_parcels: of the scene. Forgets what was learnt.
  void reset(std::uint32_t num_parcels) {
    wanted_events_ = kEventsPerParcel * num_parcels + kMoreEvents;
    ticks_ = 1.0;
  }
  // Ticks have become longer by a power of two.
  void rescale(double factor) { ticks_ = std::max(1.0, ticks_ * factor); }

  // Length of the next window: at most `limit`, and an equal part of it.
  std::uint32_t choose(std::uint32_t limit) const {
    limit = std::min(limit, max_ticks_);
    if (draw) return std::clamp(draw(limit), 1U, limit);
    const double parts = limit / ticks_;
    const auto num = static_cast<std::uint32_t>(parts) + (parts > 1.0 ? 1U : 0U);
    return num <= 1 ? limit : (limit + num - 1) / num;
  }

  // A window of `length` ticks was solved. was_cut: it was planned longer.
  void learn(std::uint32_t length, bool was_cut, const WindowOutcome& outcome) {
    max_ticks_ = UINT32_MAX;
    if (was_cut) {
      ticks_ = length;
      return;
    }
    const auto events = static_cast<double>(outcome.result.num_events);
    const double largest = std::max(kClusterEvents, kClusterShare * events);
    const double crowded = outcome.largest_cluster / largest;
    const double wasted =
        (static_cast<double>(outcome.num_solved) - events) / (kWaste * events + kClusterEvents);
    const double too_long = std::max(crowded, wasted);
    double longer = wanted_events_ / (events + 1.0);
    if (too_long > 1.0)
      longer = std::min(longer, std::max(1.0 / too_long, kShortest));
    else if (too_long > 0.5)
      longer = std::min(longer, 1.0);
    const bool is_crowd = events < 0.5 * wanted_events_ && outcome.largest_cluster > 4;
    ticks_ = std::max(1.0, length * std::min(longer, is_crowd ? kSlowGrowth : kFastGrowth));
  }
  // A window did not finish. Only its first `length` ticks are tried next.
  void shorten(std::uint32_t length) {
    max_ticks_ = length;
    ticks_ = length;
  }

  // Events of a cluster after which its window is cut.
  std::uint32_t max_cluster_events() const {
    if (event_limit) return event_limit;
    return std::max(kMinEventLimit, static_cast<std::uint32_t>(wanted_events_ / 8.0));
  }

 private:
  // Events that a window should have.
  static constexpr double kEventsPerParcel = 0.1, kMoreEvents = 64.0;
  // A window is cut only if a cluster has at least this many events.
  static constexpr std::uint32_t kMinEventLimit = 128;
  // A window is too long if its largest cluster has more events than both of these, the second one a share of
  // the window's, or if more than a share kWaste of its events were solved in vain.
  static constexpr double kClusterEvents = 48.0, kClusterShare = 1.0 / 32.0, kWaste = 0.5;
  // Factors from one window's length to the next.
  static constexpr double kShortest = 0.125;  // at least
  static constexpr double kSlowGrowth = 1.3;  // at most, in a crowd
  static constexpr double kFastGrowth = 8.0;  // at most

  double wanted_events_ = 1.0;
  double ticks_ = 1.0;
  std::uint32_t max_ticks_ = UINT32_MAX;
};

}  // namespace pf
