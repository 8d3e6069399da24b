// Chooses the length of epochs, as a multiple of the length that suits a gas. Any length is right: results do
// not depend on it. The choice, and so the order of parcels in memory, depends on events, never on the clock.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

namespace pf {

// To start an epoch costs a look at every parcel, so long ones pay where little happens for the speed of the
// fastest. But searches grow with an epoch's length, and where much happens they are most of the work.
class EpochLength {
 public:
  std::function<double()> draw;  // tests may draw lengths instead

  void reset() {
    length_ = 1.0;
    drop();
  }
  double length() const { return draw ? draw() : length_; }

  void add_events(std::uint64_t num) { num_events_ += num; }
  // An epoch has lasted as long as planned.
  void end(std::size_t num_parcels) {
    const double wanted = kEventsPerParcel * static_cast<double>(num_parcels);
    const double longer = std::sqrt(wanted / (static_cast<double>(num_events_) + 1.0));
    length_ = std::clamp(length_ * std::clamp(longer, 1.0 / kMaxChange, kMaxChange), 1.0, kLongest);
    drop();
  }
  // Ignores an epoch that ended early.
  void drop() { num_events_ = 0; }

 private:
  // Measured on an EPYC: a gas, flights over the court, with restitution and without, dilute and dense, and
  // `bullet` take the least time where starts take 0.3 to 0.5 of it. An event of a gas takes as long as the
  // start of an epoch for some 36 parcels.
  static constexpr double kEventsPerParcel = 0.04;
  static constexpr double kLongest = 4.0, kMaxChange = 1.1;

  double length_ = 1.0;
  std::uint64_t num_events_ = 0;
};

}  // namespace pf
