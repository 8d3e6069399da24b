// The earliest event of each body and the earliest of all, in a tournament tree: one leaf per body, and every
// inner node repeats the earlier of its two children. The root is therefore the next event.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace pf {

// Partner of a predicted event: another body's number, or one of these codes.
enum PartnerCode : std::uint32_t {
  kFirstPartnerCode = 0xFFFFFFF0U,  // body numbers stay below
  kPartnerBall = kFirstPartnerCode,
  kPartnerWallX,
  kPartnerWallY,
  kPartnerExit,
  kPartnerCellX,  // the body moves on to the next cell of its row
  kPartnerCellY,
};

struct PredictedEvent {
  double time_s = std::numeric_limits<double>::infinity();
  std::uint32_t owner = 0;
  std::uint32_t partner = kPartnerCellX;
};

// Orders simultaneous events by their lower, then by their higher number.
inline bool happens_before(const PredictedEvent& a, const PredictedEvent& b) {
  if (a.time_s != b.time_s) return a.time_s < b.time_s;
  return std::pair{std::min(a.owner, a.partner), std::max(a.owner, a.partner)} <
         std::pair{std::min(b.owner, b.partner), std::max(b.owner, b.partner)};
}

class EventTree {
 public:
  explicit EventTree(std::uint32_t num_bodies)
      : num_leaves_(std::bit_ceil(std::max(num_bodies, 2U))), nodes_(2UL * num_leaves_) {
    for (std::uint32_t i = 0; i < num_leaves_; ++i) nodes_[num_leaves_ + i].owner = i;
    for (std::size_t k = num_leaves_ - 1; k > 0; --k) nodes_[k] = nodes_[2 * k];
  }

  const PredictedEvent& first() const { return nodes_[1]; }

  void set(const PredictedEvent& event) {
    std::size_t k = num_leaves_ + event.owner;
    nodes_[k] = event;
    while (k > 1) {
      const PredictedEvent& left = nodes_[k & ~std::size_t{1}];
      const PredictedEvent& right = nodes_[k | 1];
      const PredictedEvent& winner = happens_before(right, left) ? right : left;
      k /= 2;
      // The event neither won here before nor wins now: nothing changes further up.
      if (nodes_[k].owner != event.owner && winner.owner != event.owner) return;
      nodes_[k] = winner;
    }
  }

 private:
  std::size_t num_leaves_;
  std::vector<PredictedEvent> nodes_;  // root at 1, children of k at 2k and 2k + 1
};

}  // namespace pf
