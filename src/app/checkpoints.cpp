#include "app/checkpoints.hpp"

#include <algorithm>

namespace pf {
namespace {

constexpr std::size_t kMaxCheckpoints = 8;
constexpr double kMinInterval_s = 1.0;
// Bytes read back per second of display: about 1 ms of each second from main memory, more over the bus of a
// GPU.
constexpr double kBytesPerSecond = 32e6;
constexpr double kMinJump_s = 0.5;

}  // namespace

std::uint64_t Checkpoints::bytes_of(std::size_t num_parcels) {
  return num_parcels * (sizeof(Vec2i) + sizeof(Vec2f)) + sizeof(Checkpoint);
}

std::size_t Checkpoints::max_count(std::size_t num_parcels) const {
  return std::min<std::uint64_t>(kMaxCheckpoints, max_bytes_ / bytes_of(num_parcels));
}

bool Checkpoints::is_due(double shown_s, std::size_t num_parcels) const {
  if (max_count(num_parcels) == 0) return false;
  const double interval_s =
      std::max(kMinInterval_s, static_cast<double>(bytes_of(num_parcels)) / kBytesPerSecond);
  return kept_.empty() || shown_s - kept_.back().shown_s >= interval_s - 1e-9;
}

void Checkpoints::keep(Checkpoint checkpoint) {
  const std::size_t limit = max_count(checkpoint.parcels.position.size());
  kept_.push_back(std::move(checkpoint));
  while (kept_.size() > limit) kept_.pop_front();
}

const Checkpoint* Checkpoints::back_from(double shown_s) {
  if (kept_.empty()) return nullptr;
  while (kept_.size() > 1 && kept_.back().shown_s > shown_s - kMinJump_s + 1e-9) kept_.pop_back();
  return &kept_.back();
}

}  // namespace pf
