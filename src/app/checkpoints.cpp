#include "app/checkpoints.hpp"

#include <algorithm>

namespace pf {
namespace {

constexpr std::size_t kMaxCheckpoints = 16;
constexpr double kMinInterval_s = 1.0;
// Bytes read back per second of display: about 1 ms of each second from main memory, more over the bus of a
// GPU.
constexpr double kBytesPerSecond = 32e6;
// A parcel in method `exact` has an anchor and two ticks besides position and velocity.
constexpr std::uint64_t kBytesPerParcel = 2 * sizeof(Vec2i) + sizeof(Vec2f) + 2 * sizeof(std::uint32_t);

}  // namespace

std::uint64_t Checkpoints::bytes_of(std::size_t num_parcels) {
  return num_parcels * kBytesPerParcel + sizeof(Checkpoint);
}

std::size_t Checkpoints::max_count(std::size_t num_parcels) const {
  return std::min<std::uint64_t>(kMaxCheckpoints, max_bytes_ / bytes_of(num_parcels));
}

bool Checkpoints::is_due(double shown_s, std::size_t num_parcels) const {
  const std::size_t limit = max_count(num_parcels);
  if (is_stopped_ || limit == 0 || (limit == 1 && !kept_.empty())) return false;
  const double interval_s =
      std::max(kMinInterval_s, static_cast<double>(bytes_of(num_parcels)) / kBytesPerSecond);
  return kept_.empty() || shown_s - kept_.back().shown_s >= interval_s - 1e-9;
}

void Checkpoints::keep(Checkpoint checkpoint) {
  const std::size_t limit = max_count(checkpoint.backend.parcels.position.size());
  kept_.push_back(std::move(checkpoint));
  while (kept_.size() > limit) thin_out();
}

// Drops the checkpoint whose neighbours are nearest to each other, of equals the oldest, so that the
// remaining ones are evenly spaced.
void Checkpoints::thin_out() {
  if (kept_.size() <= 2) return kept_.pop_back();
  std::size_t nearest = 1;
  const auto gap_s = [this](std::size_t i) { return kept_[i + 1].shown_s - kept_[i - 1].shown_s; };
  for (std::size_t i = 2; i + 1 < kept_.size(); ++i) {
    if (gap_s(i) < gap_s(nearest) - 1e-9) nearest = i;
  }
  kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(nearest));
}

const Checkpoint* Checkpoints::newest_until(std::int64_t frame) const {
  const auto found =
      std::find_if(kept_.rbegin(), kept_.rend(), [&](const Checkpoint& one) { return one.frame <= frame; });
  return found == kept_.rend() ? nullptr : &*found;
}

void Checkpoints::drop_after(std::int64_t frame, std::size_t num_changes) {
  const auto is_later = [&](const Checkpoint& one) {
    return one.frame > frame || (one.frame == frame && one.num_changes > num_changes);
  };
  while (!kept_.empty() && is_later(kept_.back())) kept_.pop_back();
}

}  // namespace pf
