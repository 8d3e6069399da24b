// The kept events of all parcels, and which of them are due.
//
// A parcel's kept event is never later than its true next one. It may be stale: its partner may have left the
// trajectory that it was predicted on. Each block of parcels has a tick before which none of them is due.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "model/exact/events.hpp"

namespace pf {

// Orders the events of a parcel: by tick, then by the partner's id.
inline std::uint64_t event_key(std::uint32_t tick, std::uint32_t partner_id) {
  return (static_cast<std::uint64_t>(tick) << 32U) | partner_id;
}
inline std::uint32_t tick_of(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32U); }

// Lowers a value that threads share.
template <class Unsigned>
void lower_to(Unsigned& value, Unsigned to) {
  std::atomic_ref<Unsigned> shared(value);
  Unsigned seen = shared.load(std::memory_order_relaxed);
  while (to < seen && !shared.compare_exchange_weak(seen, to, std::memory_order_relaxed)) {
  }
}

class Calendar {
 public:
  static constexpr std::uint64_t kNoEvent = ~0ULL;
  static constexpr std::size_t kBlock = 64;  // parcels

  // Starts an epoch. Then every parcel must be added once, in any order and by any thread.
  void reset(std::size_t num_parcels) {
    key_.resize(num_parcels);
    index_of_.resize(num_parcels);
    earliest_.assign((num_parcels + kBlock - 1) / kBlock, kNoTick);
  }
  // Adds a parcel that has no event yet. id: below the number of parcels.
  void add(std::uint32_t i, std::uint32_t id) {
    key_[i] = kNoEvent;
    index_of_[id] = i;
  }

  std::size_t num_blocks() const { return earliest_.size(); }
  std::uint64_t key(std::uint32_t i) const { return key_[i]; }
  const void* line(std::uint32_t i) const { return &key_[i]; }  // to prefetch

  Event event(std::uint32_t i) const {
    const std::uint64_t key = key_[i];
    if (key == kNoEvent) return {};
    const auto partner_id = static_cast<std::uint32_t>(key);
    return {tick_of(key), is_parcel(partner_id) ? index_of_[partner_id] : partner_id, partner_id};
  }

  // Replaces a parcel's event. One thread may do so while others lower events of other parcels.
  void set(std::uint32_t i, const Event& event) {
    key_[i] = event.tick == kNoTick ? kNoEvent : event_key(event.tick, event.partner_id);
    if (event.tick != kNoTick) lower_block(i, event.tick);
  }

  // Keeps the earlier of a parcel's event and this one. Any thread may call it.
  void lower(std::uint32_t i, std::uint32_t tick, std::uint32_t partner_id) {
    lower_to(key_[i], event_key(tick, partner_id));
    lower_block(i, tick);
  }

  // Has a parcel found when its event is due, also after it was taken out.
  void restore(std::uint32_t i) { lower_block(i, tick_of(key_[i])); }

  // Appends the parcels of a block whose events come before tick `end`, and takes them out: they are found
  // again once `set`, `lower` or `restore` has been called for them.
  void take_due(std::size_t block, std::uint32_t end, std::vector<std::uint32_t>& due) {
    if (earliest_[block] >= end) return;
    const std::size_t first = block * kBlock, last = std::min(key_.size(), first + kBlock);
    std::uint32_t rest = kNoTick;
    for (std::size_t i = first; i < last; ++i) {
      const std::uint32_t tick = tick_of(key_[i]);
      if (tick < end)
        due.push_back(static_cast<std::uint32_t>(i));
      else
        rest = std::min(rest, tick);
    }
    earliest_[block] = rest;
  }

  // A tick before which nothing is due.
  std::uint32_t earliest() const {
    std::uint32_t tick = kNoTick;
    for (const std::uint32_t of_block : earliest_) tick = std::min(tick, of_block);
    return tick;
  }

  std::uint64_t memory_bytes() const {
    return 8 * key_.capacity() + 4 * (earliest_.capacity() + index_of_.capacity());
  }

 private:
  void lower_block(std::uint32_t i, std::uint32_t tick) { lower_to(earliest_[i / kBlock], tick); }

  std::vector<std::uint64_t> key_;       // n
  std::vector<std::uint32_t> earliest_;  // of each block
  std::vector<std::uint32_t> index_of_;  // n; by id
};

}  // namespace pf
