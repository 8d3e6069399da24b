// The queue of a cluster's events, earliest first.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "model/exact/events.hpp"

namespace pf {

class EventQueue {
 public:
  struct Entry : EventOrder {
    std::uint32_t member;
    std::uint32_t version;  // stale once the member has another
  };

  void clear() { entries_.clear(); }
  bool empty() const { return entries_.empty(); }

  // id: of the member, or its code.
  void push(std::uint32_t member, std::uint32_t version, std::uint32_t id, const Event& event) {
    if (event.tick == kNoTick) return;
    entries_.push_back(
        {{event.tick, event.generation, std::min(id, event.partner_id), std::max(id, event.partner_id)},
         member,
         version});
    std::push_heap(entries_.begin(), entries_.end(), is_later);
  }

  Entry pop() {
    const Entry next = entries_.front();
    std::pop_heap(entries_.begin(), entries_.end(), is_later);
    entries_.pop_back();
    return next;
  }

 private:
  static bool is_later(const Entry& a, const Entry& b) { return comes_before(b, a); }

  std::vector<Entry> entries_;
};

}  // namespace pf
