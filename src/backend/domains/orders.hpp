// Orders of rank 0 to the other ranks, with their arguments as bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "model/spawn.hpp"

namespace pf {

// All but `open`, `leave` and `close` name a function of DomainGroup.
enum class Order : std::uint8_t {
  // A new group: number of domains; threads of a rank (0: all of the machine, shared by its ranks); whether
  // it works on GPUs; how they are linked.
  open,
  reset,
  set_physics,
  set_ball,
  restore,
  resume,
  advance,
  gather,
  draw,
  count,
  gather_in,
  measure,
  profile,
  state_hash,
  measure_copy_bandwidth,
  leave,  // the ranks do other work, and serve again after it
  close   // the ranks end
};

// Plain values one after the other. All ranks run the same program on processors of one kind.
class Message {
 public:
  Message() = default;
  explicit Message(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  template <class T>
  Message& put(const T& value) {
    return put_array(&value, 1);
  }
  template <class T>
  Message& put_array(const T* values, std::size_t num) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::size_t before = bytes_.size();
    bytes_.resize(before + num * sizeof(T));
    if (num > 0) std::memcpy(bytes_.data() + before, values, num * sizeof(T));
    return *this;
  }
  // In the order of put.
  template <class T>
  T get() {
    return get_array<T>(1)[0];
  }
  template <class T>
  std::vector<T> get_array(std::size_t num) {
    std::vector<T> values(num);
    if (num > 0) std::memcpy(values.data(), bytes_.data() + next_, num * sizeof(T));
    next_ += num * sizeof(T);
    return values;
  }
  std::vector<std::byte>& bytes() { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
  std::size_t next_ = 0;
};

// A plan with its rows.
struct OwnedPlan {
  SpawnPlan plan;
  std::vector<std::uint64_t> row_start;
  std::vector<std::uint32_t> blocked_first, blocked_count;
};

inline void put_plan(Message& message, const SpawnPlan& plan) {
  message.put(plan);
  if (plan.row_start == nullptr) return;
  message.put_array(plan.row_start, plan.num_rows + 1)
      .put_array(plan.row_blocked_first, plan.num_rows)
      .put_array(plan.row_blocked_count, plan.num_rows);
}

inline OwnedPlan get_plan(Message& message) {
  OwnedPlan owned;
  owned.plan = message.get<SpawnPlan>();
  if (owned.plan.row_start == nullptr) return owned;
  owned.row_start = message.get_array<std::uint64_t>(owned.plan.num_rows + 1);
  owned.blocked_first = message.get_array<std::uint32_t>(owned.plan.num_rows);
  owned.blocked_count = message.get_array<std::uint32_t>(owned.plan.num_rows);
  owned.plan.row_start = owned.row_start.data();
  owned.plan.row_blocked_first = owned.blocked_first.data();
  owned.plan.row_blocked_count = owned.blocked_count.data();
  return owned;
}

}  // namespace pf
