// The queue of a cluster's events, earliest first. Of events at one tick, the one of the lower generation
// comes first, then the one with the lower id, then the one with the lower other id.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "model/exact/events.hpp"

namespace pf {

class EventQueue {
 public:
  struct Entry {
    std::uint32_t tick, generation, low_id, high_id;
    std::uint32_t member;
    std::uint32_t version;  // stale once the member has another
  };

  void clear() { entries_.clear(); }
  bool empty() const { return entries_.empty(); }

  // id: of the member, or its code.
  void push(std::uint32_t member, std::uint32_t version, std::uint32_t id, const Event& event) {
    if (event.tick == kNoTick) return;
    entries_.push_back({event.tick, event.generation, std::min(id, event.partner_id),
                        std::max(id, event.partner_id), member, version});
    std::push_heap(entries_.begin(), entries_.end(), is_later);
  }

  Entry pop() {
    const Entry next = entries_.front();
    std::pop_heap(entries_.begin(), entries_.end(), is_later);
    entries_.pop_back();
    return next;
  }

 private:
  static bool is_later(const Entry& a, const Entry& b) {
    if (a.tick != b.tick) return a.tick > b.tick;
    if (a.generation != b.generation) return a.generation > b.generation;
    if (a.low_id != b.low_id) return a.low_id > b.low_id;
    return a.high_id > b.high_id;
  }

  std::vector<Entry> entries_;
};

}  // namespace pf
