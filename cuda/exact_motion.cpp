#include "exact_motion.cuh"

#include <cmath>

namespace pf {
namespace {

// Room in a segment for one in `share` of its parcels, and some more where parcels are few.
std::uint32_t segment_capacity(std::uint32_t num_parcels, std::uint32_t num_segments, std::uint32_t share) {
  constexpr std::uint32_t kLeast = 64;
  return num_parcels / (num_segments * share) + kLeast;
}

// One parcel in so many may have an event, be lowered, change, be flagged, be near the ball.
constexpr std::uint32_t kShares[6] = {4, 4, 4, 8, 8, 16};
constexpr std::uint32_t kSavedShare = 8;

}  // namespace

void DeviceExact::reset_time() {
  active_ = false;
  time_s_ = 0.0;
  now_ = 0;
}

DeviceExact::List DeviceExact::make_list(std::uint32_t num_parcels, std::uint32_t share) const {
  List list;
  list.capacity = segment_capacity(num_parcels, num_segments_, share);
  list.items = DeviceBuffer<std::uint32_t>(static_cast<std::size_t>(list.capacity) * num_segments_);
  list.counts = DeviceBuffer<std::uint32_t>(num_segments_);
  return list;
}

void DeviceExact::reserve(std::uint32_t num_parcels) {
  if (num_parcels == reserved_) return;
  num_segments_ = exact_num_segments(num_parcels);
  for (int k = 0; k < 6; ++k) {
    lists_[k] = {};
    lists_[k] = make_list(num_parcels, kShares[k]);
  }
  saved_capacity_ = segment_capacity(num_parcels, num_segments_, kSavedShare);
  saved_ = {};
  saved_ = DeviceBuffer<SavedLine>(static_cast<std::size_t>(saved_capacity_) * num_segments_);
  num_saved_ = DeviceBuffer<std::uint32_t>(num_segments_);
  reserved_ = num_parcels;
}

std::size_t DeviceExact::bytes() const {
  std::size_t sum = saved_.bytes() + num_saved_.bytes();
  for (const List& list : lists_) sum += list.items.bytes() + list.counts.bytes();
  return sum;
}

void DeviceExact::complete(const Memory& memory, ExactLaunch& launch) const {
  ExactArrays& a = launch.arrays;
  a.lines = memory.lines;
  a.present[0] = memory.free.position;
  a.present[1] = reinterpret_cast<Vec2i*>(memory.free.velocity);
  a.mark = memory.free.tick;
  a.event_tick = memory.scratch[0];
  a.event_partner = memory.scratch[1];
  a.bound = memory.scratch[2];
  a.active[0] = lists_[0].view();
  a.active[1] = lists_[1].view();
  a.lowered = lists_[2].view();
  a.changed = lists_[3].view();
  a.flagged = lists_[4].view();
  a.near_ball = lists_[5].view();
  a.saved = saved_.data();
  a.num_saved = num_saved_.data();
  a.saved_capacity = saved_capacity_;
  a.num_segments = num_segments_;
  launch.state = state_.data();
}

void DeviceExact::enter(const ExactLaunch& launch, cudaStream_t stream) {
  now_ = static_cast<std::uint64_t>(std::llround(time_s_ / launch.constants.tick_s));
  launch_exact_enter(launch, now_, stream);
  active_ = true;
}

std::vector<std::uint64_t> DeviceExact::plan(const StepRequest& request, double tick_s) {
  std::vector<std::uint64_t> ends;
  const double start_s = time_s_;
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    time_s_ = start_s + k * request.dt_s;
    const auto end = static_cast<std::uint64_t>(std::llround(time_s_ / tick_s));
    if (end > now_) ends.push_back(now_ = end);
  }
  return ends;
}

}  // namespace pf
