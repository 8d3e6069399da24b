// Positions in 16 bits a coordinate, for the first test of a pair: eight squared distances take two vector
// instructions, and half as much memory is read.
//
// The low bits are dropped, so that a difference is right within a unit. The high ones are lost: differences
// of 2^15 units, eight contact distances or more, may look small, but small ones never large.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "backend/candidate_ranges.hpp"
#include "core/resize.hpp"
#include "core/thread_team.hpp"
#include "model/parcel.hpp"

namespace pf {

class RoughScale {
 public:
  // A scale without positions.
  RoughScale() = default;
  explicit RoughScale(const StepConstants& constants) : shift_(0) {
    constexpr double kMaxContactDistance = 4096.0;  // units
    double contact_distance = std::sqrt(static_cast<double>(constants.filter_distance2));
    for (; contact_distance > kMaxContactDistance; ++shift_) contact_distance *= 0.5;
    constexpr double kError = 1.5;  // of the length of a difference: less than a unit along either axis
    const double reach = contact_distance + kError;
    limit_ = static_cast<std::int32_t>(reach * reach) + 1;
  }

  bool operator==(const RoughScale&) const = default;

  std::int32_t shift() const { return shift_; }
  // Squared distances of pairs that touch are below this, squared units.
  std::int32_t limit() const { return limit_; }
  std::uint32_t operator()(Vec2i position) const {
    return (static_cast<std::uint32_t>(position.x >> shift_) & 0xFFFFU) |
           (static_cast<std::uint32_t>(position.y >> shift_) << 16);
  }

 private:
  std::int32_t shift_ = -1;
  std::int32_t limit_ = 0;
};

// Rough positions of all parcels, in memory order.
class RoughPositions {
 public:
  const RoughScale& scale() const { return scale_; }
  const std::uint32_t* data() const { return at_.data(); }  // kSearchPadding more than parcels
  std::uint32_t* data() { return at_.data(); }
  void set(std::size_t i, Vec2i position) { at_[i] = scale_(position); }
  std::uint64_t memory_bytes() const { return sizeof(std::uint32_t) * at_.capacity(); }

  // Positions have changed since.
  void forget() { scale_ = {}; }
  // Only those of `moved` have.
  void update(const std::vector<std::uint32_t>& moved, const Vec2i* position) {
    if (scale_ == RoughScale{}) return;
    for (const std::uint32_t i : moved) set(i, position[i]);
  }
  // Rounds all positions, unless they have been followed in this scale.
  void follow(ThreadTeam& team, const RoughScale& scale, const Vec2i* position, std::size_t num) {
    if (scale == scale_ && at_.size() == num + kSearchPadding) return;
    scale_ = scale;
    resize_tightly(at_, num + kSearchPadding);
    team.run([&](unsigned thread) {
      const auto [begin, end] = team.share(thread, num);
      for (std::size_t i = begin; i < end; ++i) set(i, position[i]);
    });
  }

 private:
  RoughScale scale_;
  std::vector<std::uint32_t> at_;
};

}  // namespace pf
