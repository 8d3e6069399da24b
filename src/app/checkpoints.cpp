#include "app/checkpoints.hpp"

#include <algorithm>

namespace pf {
namespace {

constexpr std::size_t kMaxMoments = 8;
constexpr double kApart_s = 1.0;
// As many bytes as are read back per second of the show: about 1 ms of each second on a desktop's memory,
// some more over the bus of a GPU.
constexpr double kBytesPerSecond = 32e6;
constexpr double kMinJump_s = 0.5;

}  // namespace

std::uint64_t Checkpoints::bytes_of(std::size_t num_parcels) {
  return num_parcels * (sizeof(Vec2i) + sizeof(Vec2f)) + sizeof(Checkpoint);
}

std::size_t Checkpoints::most(std::size_t num_parcels) const {
  return std::min<std::uint64_t>(kMaxMoments, max_bytes_ / bytes_of(num_parcels));
}

bool Checkpoints::is_due(double shown_s, std::size_t num_parcels) const {
  if (most(num_parcels) == 0) return false;
  const double apart_s = std::max(kApart_s, static_cast<double>(bytes_of(num_parcels)) / kBytesPerSecond);
  return kept_.empty() || shown_s - kept_.back().shown_s >= apart_s - 1e-9;
}

void Checkpoints::keep(Checkpoint moment) {
  const std::size_t limit = most(moment.parcels.position.size());
  kept_.push_back(std::move(moment));
  while (kept_.size() > limit) kept_.pop_front();
}

const Checkpoint* Checkpoints::back_from(double shown_s) {
  if (kept_.empty()) return nullptr;
  while (kept_.size() > 1 && kept_.back().shown_s > shown_s - kMinJump_s + 1e-9) kept_.pop_back();
  return &kept_.back();
}

}  // namespace pf
