// The earliest event of each body, and the earliest of all: a tournament tree. One leaf per body, every inner
// node repeats the earlier of its two children, so the root is the next event.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace pf {

// What a body meets next: another body's number, or one of these.
enum Meeting : std::uint32_t {
  kFirstSpecial = 0xFFFFFFF0U,  // body numbers stay below
  kMeetsBall = kFirstSpecial,
  kMeetsWallX,
  kMeetsWallY,
  kMeetsExit,
  kMeetsCellX,  // moves on to the next cell of its row
  kMeetsCellY,
};

struct PlannedEvent {
  double time_s = std::numeric_limits<double>::infinity();
  std::uint32_t owner = 0;
  std::uint32_t meets = kMeetsCellX;
};

// Simultaneous events come by lower, then by higher number.
inline bool happens_before(const PlannedEvent& a, const PlannedEvent& b) {
  if (a.time_s != b.time_s) return a.time_s < b.time_s;
  return std::pair{std::min(a.owner, a.meets), std::max(a.owner, a.meets)} <
         std::pair{std::min(b.owner, b.meets), std::max(b.owner, b.meets)};
}

class EventTree {
 public:
  explicit EventTree(std::uint32_t num_bodies)
      : num_leaves_(std::bit_ceil(std::max(num_bodies, 2U))), nodes_(2UL * num_leaves_) {
    for (std::size_t k = 0; k < nodes_.size(); ++k) nodes_[k].owner = static_cast<std::uint32_t>(k);
    for (std::uint32_t i = 0; i < num_leaves_; ++i) nodes_[num_leaves_ + i].owner = i;
    for (std::size_t k = num_leaves_ - 1; k > 0; --k) nodes_[k] = nodes_[2 * k];
  }

  const PlannedEvent& first() const { return nodes_[1]; }
  const PlannedEvent& of(std::uint32_t body) const { return nodes_[num_leaves_ + body]; }

  void set(const PlannedEvent& event) {
    std::size_t k = num_leaves_ + event.owner;
    nodes_[k] = event;
    while (k > 1) {
      const PlannedEvent& left = nodes_[k & ~std::size_t{1}];
      const PlannedEvent& right = nodes_[k | 1];
      const PlannedEvent& winner = happens_before(right, left) ? right : left;
      k /= 2;
      // Neither won here before nor wins now: nothing changes further up.
      if (nodes_[k].owner != event.owner && winner.owner != event.owner) return;
      nodes_[k] = winner;
    }
  }

 private:
  std::size_t num_leaves_;
  std::vector<PlannedEvent> nodes_;  // root at 1, children of k at 2k and 2k + 1
};

}  // namespace pf
