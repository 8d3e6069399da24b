// The kept events of all parcels, and which of them are due.
//
// A parcel's kept event is never later than its true next one. It may be stale: its partner may have left the
// trajectory that it was predicted on. Each block of parcels has a tick before which none of them is due, and
// so has each group of blocks.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "model/exact/event_key.hpp"

namespace pf {

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
  // Parcels. With 64 a window of few events reads more: two threads of an EPYC take 84 ms in the median and
  // 108 at the 99th percentile for the first 30 frames of the court of 10^6, and 82 and 101 with 32.
  static constexpr std::size_t kBlock = 32;
  static constexpr std::size_t kGroup = 64 * kBlock;  // the same

  // Starts an epoch. Then every parcel must be cleared. id: of the parcels, which stays where it is.
  void reset(const std::vector<std::uint32_t>& id) {
    id_ = id.data();
    key_.resize(id.size());
    earliest_.assign((id.size() + kBlock - 1) / kBlock, kNoTick);
    earliest_in_group_.assign((id.size() + kGroup - 1) / kGroup, kNoTick);
  }
  void clear(std::size_t begin, std::size_t end) {
    std::fill(key_.data() + begin, key_.data() + end, kNoEventKey);
  }

  const void* line(std::uint32_t i) const { return &key_[i]; }  // to prefetch
  std::uint32_t tick(std::uint32_t i) const { return tick_of(key_[i]); }

  Event event(std::uint32_t i) const {
    const EventKey key = key_[i];
    if (key == kNoEventKey) return {};
    const std::uint32_t partner = partner_of(key);
    return {tick_of(key), partner, id_of(partner)};
  }

  // Returns whether a collision with `partner` comes before parcel i's kept event.
  bool would_lower(std::uint32_t i, std::uint32_t tick, std::uint32_t partner) const {
    return comes_before(event_key(tick, partner), key_[i]);
  }

  // Replaces a parcel's event. One thread may do so while others lower events of other parcels.
  void set(std::uint32_t i, const Event& event) {
    key_[i] = event.tick == kNoTick ? kNoEventKey : event_key(event.tick, event.partner);
    if (event.tick != kNoTick) lower_block(i, event.tick);
  }

  // Keeps the earlier of a parcel's event and this one. Any thread may call it.
  void lower(std::uint32_t i, std::uint32_t tick, std::uint32_t partner) {
    const EventKey key = event_key(tick, partner);
    std::atomic_ref<EventKey> shared(key_[i]);
    EventKey seen = shared.load(std::memory_order_relaxed);
    while (comes_before(key, seen)) {
      if (shared.compare_exchange_weak(seen, key, std::memory_order_relaxed)) return lower_block(i, tick);
    }
  }

  // Makes take_due() find the parcel again.
  void restore(std::uint32_t i) { lower_block(i, tick(i)); }

  // Appends the groups with events before tick `end`.
  void list_due_groups(std::uint32_t end, std::vector<std::uint32_t>& groups) const {
    for (std::uint32_t group = 0; group < earliest_in_group_.size(); ++group) {
      if (earliest_in_group_[group] < end) groups.push_back(group);
    }
  }

  // Appends the parcels of a group whose events come before tick `end`, and takes them out: they are found
  // again once `set`, `lower` or `restore` has been called for them.
  void take_due(std::size_t group, std::uint32_t end, std::vector<std::uint32_t>& due) {
    constexpr std::size_t kBlocks = kGroup / kBlock;
    const std::size_t first = group * kBlocks, last = std::min(earliest_.size(), first + kBlocks);
    std::uint32_t rest = kNoTick, num_due = 0;
    std::size_t due_blocks[kBlocks];
    for (std::size_t block = first; block < last; ++block) {
      if (earliest_[block] >= end) {
        rest = std::min(rest, earliest_[block]);
        continue;
      }
      due_blocks[num_due++] = block;
      const std::size_t block_end = std::min(key_.size(), (block + 1) * kBlock);
      for (std::size_t i = block * kBlock; i < block_end; i += kKeysOfLine) __builtin_prefetch(&key_[i]);
    }
    for (std::uint32_t k = 0; k < num_due; ++k) {
      const std::size_t block = due_blocks[k];
      earliest_[block] = take_due_of_block(block, end, due);
      rest = std::min(rest, earliest_[block]);
    }
    earliest_in_group_[group] = rest;
  }

  std::uint64_t memory_bytes() const {
    return 8 * key_.capacity() + 4 * (earliest_.capacity() + earliest_in_group_.capacity());
  }

 private:
  static constexpr std::size_t kKeysOfLine = 8;  // of the cache

  std::uint32_t id_of(std::uint32_t partner) const { return is_parcel(partner) ? id_[partner] : partner; }
  bool comes_before(EventKey a, EventKey b) const {
    return pf::comes_before(a, b, [this](std::uint32_t partner) { return id_of(partner); });
  }

  void lower_block(std::uint32_t i, std::uint32_t tick) {
    lower_to(earliest_[i / kBlock], tick);
    lower_to(earliest_in_group_[i / kGroup], tick);
  }

  // Returns the earliest tick of the events that stay.
  std::uint32_t take_due_of_block(std::size_t block, std::uint32_t end,
                                  std::vector<std::uint32_t>& due) const {
    const std::size_t first = block * kBlock, last = std::min(key_.size(), first + kBlock);
    std::uint32_t rest = kNoTick, num_due = 0;
    std::uint32_t due_here[kBlock];
    for (std::size_t i = first; i < last; ++i) {  // branch-free, as the branches are unpredictable
      const std::uint32_t tick = tick_of(key_[i]);
      due_here[num_due] = static_cast<std::uint32_t>(i);
      num_due += tick < end ? 1 : 0;
      rest = std::min(rest, tick < end ? kNoTick : tick);
    }
    due.insert(due.end(), due_here, due_here + num_due);
    return rest;
  }

  const std::uint32_t* id_ = nullptr;             // n
  std::vector<EventKey> key_;                     // n
  std::vector<std::uint32_t> earliest_;           // of each block
  std::vector<std::uint32_t> earliest_in_group_;  // of each group
};

}  // namespace pf
